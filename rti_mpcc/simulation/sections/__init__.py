"""The tables of scenario files and files of docks, one module a table, as frozen pydantic models."""
