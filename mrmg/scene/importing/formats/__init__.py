"""The formats that can be imported, one module each; `registry` finds them."""
