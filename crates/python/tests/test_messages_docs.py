"""The snippets of the documentation run, and print what it shows."""

import gzip
import re
import subprocess
import sys

import evidence
import jaus.stubs
import pytest
from test_messages_types import type_errors

PAGE = evidence.REPOSITORY / "docs/python-messages.md"
EXAMPLES = evidence.REPOSITORY / "crates/python/examples"


def printed(example, *arguments):
    command = [sys.executable, "-W", "error", str(EXAMPLES / example), *map(str, arguments)]
    run = subprocess.run(command, capture_output=True, text=True)
    assert (run.returncode, run.stderr) == (0, "")
    return run.stdout


def outputs():
    """The blocks that show what a program prints."""
    return re.findall(r"```text\n(.*?)```", PAGE.read_text(), re.DOTALL)


def test_the_examples_print_what_the_page_shows(tmp_path):
    capture = tmp_path / "drive.pcap"
    recorded = evidence.CAPTURES / "jauspp/01-vehsim-client.pcap.gz"
    capture.write_bytes(gzip.decompress(recorded.read_bytes()))
    shown = "".join(outputs())
    for example in (["messages.py"], ["lamps.py"], ["capture.py", capture]):
        for line in printed(*example).splitlines():
            assert line in shown, line


def test_a_module_of_own_definitions_has_types(tmp_path):
    module = re.search(r"# example_lamps\.py\n(.*?)```", PAGE.read_text(), re.DOTALL)[1]
    (tmp_path / "example_lamps.py").write_text(module)
    (tmp_path / "lamps.xml").write_text((EXAMPLES / "lamps.xml").read_text())
    assert jaus.stubs.main([str(tmp_path / "lamps.xml"), "-o", str(tmp_path)]) == 0
    usage = tmp_path / "usage.py"
    usage.write_text(
        "import example_lamps\n"
        "lamp = example_lamps.SetLamps.Lamp(place=1, brightness_percent=3)\n"
        "octets: bytes = example_lamps.SetLamps(lamp_list=[lamp]).encode()\n"
    )
    assert type_errors(tmp_path, usage) == ""
    subprocess.run([sys.executable, str(usage)], check=True)


@pytest.mark.parametrize("example", ["messages.py", "lamps.py", "capture.py"])
def test_each_example_is_on_the_page(example):
    assert f"{{{{#include ../crates/python/examples/{example}" in PAGE.read_text()
