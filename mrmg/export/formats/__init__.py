"""The formats a run can be exported to, one module each; `export.table` finds them."""
