"""The energy of motion: its model, the ledger of a plan, visits, metering and audit."""
