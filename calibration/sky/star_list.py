"""Star lists as they are written: ``id,x_m,y_m,std_x_m,std_y_m,times_seen``."""

from collections.abc import Iterable, Sequence

from groundstation.files.number_tables import csv_text

COLUMNS = ("id", "x_m", "y_m", "std_x_m", "std_y_m", "times_seen")


def star_list_text(rows: Iterable[Sequence[str]]) -> str:
    """Return the text of a list."""
    return csv_text(COLUMNS, rows)


def star_row(
    name: str, place_m: Sequence[float], sigma_m: Sequence[float], times_seen: int
) -> tuple[str, ...]:
    """Return a row: place and one sigma in x and y, and in how many pictures the star was seen."""
    x, y = (f"{value:.6f}" for value in place_m)
    sigma_x, sigma_y = (f"{value:.2e}" for value in sigma_m)
    return name, x, y, sigma_x, sigma_y, str(times_seen)
