"""Makes the reproduction table of a study from whatever its stages have left.

python -m calibration.reproduction results/salt [results/salt-paper ...]
"""

import sys
from pathlib import Path

import yaml

from calibration.config import parse_config
from calibration.reproduction import counts, reproduce, write_reproduction


def main(folder, *others):
    """Write reproduction/ into the study's folder and print the counts."""
    config = parse_config(yaml.safe_load(Path("config/config.yaml").read_text()))
    table = reproduce([folder, *others], config)
    out = Path(folder) / "reproduction"
    write_reproduction(table, out / "reproduction.csv", out / "reproduction.json")
    print(counts(table))


if __name__ == "__main__":
    main(*sys.argv[1:])
