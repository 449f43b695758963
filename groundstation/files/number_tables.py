"""Tables of numbers and words, as ``drivers.files`` reads them for the emulator, too."""

from drivers.files.number_tables import Table, csv_text, load_table, parse_table

__all__ = ["Table", "csv_text", "load_table", "parse_table"]
