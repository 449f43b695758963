"""An attendant that cannot do what it is told ends with a sentence, and tells whether to try again."""

import subprocess
import sys
from pathlib import Path

import pytest

from groundstation.launch.child import REFUSAL
from groundstation.launch.process import TROUBLE

RIG = Path(__file__).parents[4] / "examples" / "rigs" / "drawn_fixes.toml"
START = """
import sys
from pathlib import Path
from groundstation.console.access import Access
from groundstation.console.options import attendant
from groundstation.launch import attendant as attending
from groundstation.launch.orders import Orders

path = Path(sys.argv[1])
console = attendant(Access(sys.argv[2]))
attending.run(Orders("console", path, path.read_text(), "tcp/127.0.0.1:1", attendant=console))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("host", "code", "sentence"),
    [
        ("127.0.0.1", TROUBLE, "the hub at tcp/127.0.0.1:1 cannot be reached"),
        ("0.0.0.0", REFUSAL, "a console at 0.0.0.0 needs TLS"),
    ],
)
def test_what_a_console_cannot_do_is_one_sentence(host, code, sentence):
    words = [sys.executable, "-c", START, RIG, host]
    done = subprocess.run(
        words, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == code
    assert done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith(sentence)
