"""What the tables of the result pages share: reading CSV files, writing numbers, and the list of tables."""
import csv
from pathlib import Path

RESULTS = Path(__file__).parents[2] / "results"
TABLES = {}  # name in the page: function that returns the heading and the rows of cells


def read(name, **wanted):
    """The rows of a CSV file of the results whose columns have the wanted values."""
    with open(RESULTS / name, newline="") as file:
        return [row for row in csv.DictReader(file) if all(row[key] == value for key, value in wanted.items())]


def table(name):
    def register(function):
        TABLES[name] = function
        return function

    return register


def plain(name, source, columns, keep=lambda row: True):
    """A table whose rows are those of a CSV file. Columns are (heading, CSV column or function of a row, format)."""
    def build():
        rows = [row for row in read(source) if keep(row)]
        return [heading for heading, _, _ in columns], [
            [write(row[value] if isinstance(value, str) else value(row)) for _, value, write in columns]
            for row in rows]

    TABLES[name] = build


def text(value):
    return str(value)


def number(value, digits=3):
    """A number with so many digits and a space between thousands; empty if it was not measured."""
    if value in ("", None) or float(value) == -1:
        return ""
    x = float(value)
    return count(x) if 10 ** digits <= abs(x) < 1e9 else f"{x:.{digits}g}"


def precise(value):
    return number(value, 4)


def count(value):
    return "" if value in ("", None) else f"{round(float(value)):,}".replace(",", " ")


def ratio(value):
    return f"{value:.1f}" if value >= 9.995 else f"{value:.2f}"


def percent(value):
    return "all" if value == 1 else f"{100 * value:.0f} %"


def distinct(values):
    return list(dict.fromkeys(values))
