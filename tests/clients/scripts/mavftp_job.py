"""pymavlink's file transfer tool: list, get, checksums, parameters over a lossy link, refusals.

Argument: the address of the vehicle's link. Files go to the working directory.
"""

import subprocess
import sys
import zlib
from pathlib import Path

from facts import fact

# The tool drops packets at random and opens a file in three attempts: with this seed one arrives.
SEEDED = (
    "import random, runpy; random.seed(1); "
    "runpy.run_module('pymavlink.mavftp', run_name='__main__', alter_sys=True)"
)
PACK, METADATA = "@PARAM/param.pck", "component_metadata/general.json"


def tool(address: str, *words: str) -> tuple[int, str]:
    """Run the tool; return its exit code and what it has said."""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", SEEDED, "--device", address, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout


def work(address: str) -> None:
    """Do one thing after the other."""
    code, said = tool(address, "list", "/")
    fact(list=code, directories=[word for word in said.split() if word.endswith("/")])
    code, _ = tool(address, "get", PACK, "param.pck")
    fact(get=code, size=Path("param.pck").stat().st_size)
    tool(address, "get", METADATA, "general.json")
    code, said = tool(address, "crc", METADATA)
    fact(crc=code, same=f"0x{_crc(Path('general.json').read_bytes()):x}" in said)
    losses = "--pkt_loss_rx", "10", "--pkt_loss_tx", "10"
    code, _ = tool(address, *losses, "getparams", "lossy.param")
    fact(getparams=code, parameters=len(Path("lossy.param").read_text().splitlines()))
    Path("mine").write_text("mine")
    refused = {
        "get": tool(address, "get", "/nothing", "nothing")[0],
        "rm": tool(address, "rm", PACK)[0],
        "put": tool(address, "put", "mine", "/mine")[0],
    }
    fact(refused=refused)


def _crc(data: bytes) -> int:
    """Return MAVLink's checksum of a file: a CRC-32 that is inverted neither before nor after."""
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


if __name__ == "__main__":
    work(*sys.argv[1:])
