from pathlib import Path

import numpy as np
import pytest

from groundstation.files.errors import FileError
from groundstation.files.number_tables import csv_text, load_table, parse_table

PATH = Path("table.csv")
PLAIN = "id,x_m,y_m\n0,1.5,2\n1,-0.25,3e-1\n"
WANT = [[1.5, 2.0], [-0.25, 0.3]]


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        PLAIN.replace("\n", "\r\n"),
        "\ufeff" + PLAIN,
        PLAIN.rstrip("\n"),
        "\n\n" + PLAIN + "\n\n",
        PLAIN.replace(",", ";"),
        PLAIN.replace(",", "\t"),
        PLAIN.replace(",", ";").replace(".", ","),
        '"id","x_m","y_m"\n"0","1.5","2"\n"1","-0.25","3e-1"\n',
        '"id","x_m","y_m"\n"0",1.5,2\n"1",-0.25,3e-1\n'.replace(",", ";").replace(".", ","),
        " id , x_m , y_m \n 0 , 1.5 , 2 \n 1 , -0.25 , 3e-1 \n",
        "y_m,note,x_m,id\n2,a,1.5,0\n3e-1,b,-0.25,1\n",
    ],
)
def test_a_table_may_come_from_any_program(text):
    table = parse_table(text.encode(), PATH, ("x_m", "y_m"), ("id",))
    assert table.numbers.tolist() == WANT
    assert table.words["id"] == ["0", "1"]
    assert parse_table(text.encode(), PATH, ("x_m", "y_m")).numbers.tolist() == WANT


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        ("", "is empty, expected the header id,x_m,y_m"),
        ("id,x_m,y_m\n", "has a header but no rows"),
        ("id,x_m\n0,1\n", "line 1, column 'y_m' is missing; found id, x_m"),
        ("id,x_m,y_m,x_m\n0,1,2,3\n", "line 1, column 'x_m' appears twice"),
        (PLAIN + "\n2,one,3\n", r"line 5, x_m is 'one', expected a number"),
        (PLAIN + "2,,3\n", r"line 4, x_m is '', expected a number"),
        (PLAIN + "2,1_000,3\n", r"line 4, x_m is '1_000', expected a number"),
        (PLAIN + "2,nan,3\n", r"line 4, x_m is 'nan', expected a number"),
        (PLAIN + "2,1,3,4\n", "line 4 has 4 columns, expected 3"),
        (PLAIN + "2,1\n", "line 4 has 2 columns, expected 3"),
        (PLAIN + "0,1,3\n", "line 4, id '0' appears twice, first in line 2"),
        (PLAIN + '2,"1,3\n', "line 4 is no row of a table"),
    ],
)
def test_what_is_wrong_is_named_by_line_and_column(text, reported):
    with pytest.raises(FileError, match=r"^table\.csv: " + reported):
        parse_table(text.encode(), PATH, ("x_m", "y_m"), ("id",), unique=("id",))


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        ("t_s,x_m\n0,1\n1,none\n", "line 3, x_m is 'none', expected a number"),
        ("t_s,x_m\n0,1\n1,2,3\n4\n", "line 3 has 3 columns, expected 2"),
        ("t_s,x_m\n0,1\n1,inf\n", "line 3, x_m is 'inf', expected a number"),
        ("t_s,x_m\n0,1\n1;2\n", "line 3 has 1 columns, expected 2"),
    ],
)
def test_numbers_alone_are_judged_as_strictly(text, reported):
    with pytest.raises(FileError, match=reported):
        parse_table(text.encode(), PATH, ("t_s", "x_m"))


def test_a_stamp_that_is_no_number_may_be_let_through():
    table = parse_table(b"t_s,x_m\nnan,1\n-inf,2\n", PATH, ("t_s", "x_m"), is_finite=False)
    assert np.array_equal(table.numbers, [[np.nan, 1.0], [-np.inf, 2.0]], equal_nan=True)


def test_a_column_may_be_optional():
    table = parse_table(b"x_m\n1\n", PATH, ("x_m", "std_m"), optional=("std_m",))
    assert np.array_equal(table.numbers, [[1.0, np.nan]], equal_nan=True)


def test_bytes_that_are_no_text_are_refused_with_their_line():
    with pytest.raises(FileError, match=r"is not a text file \(line 2 is no UTF-8\)"):
        parse_table(b"x_m\n\xff\xfe\n", PATH, ("x_m",))


def test_a_missing_file_is_one_sentence(tmp_path):
    with pytest.raises(FileError, match=r"nowhere\.csv: cannot be read \(No such file or directory\)\.$"):
        load_table(tmp_path / "nowhere.csv", ("x_m",))


def test_what_is_written_is_read_again():
    text = csv_text(("id", "x_m"), [("a,b", 1.5), ('say "c"', 2)])
    table = parse_table(text.encode(), PATH, ("x_m",), ("id",))
    assert table.words["id"] == ["a,b", 'say "c"']
    assert table.numbers.tolist() == [[1.5], [2.0]]
