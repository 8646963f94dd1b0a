"""A study under another name: its files in a new folder, its paths and its name changed."""

import re
import shutil
from pathlib import Path

from calibration.errors import CalibrationError, ConfigError
from calibration.files import write_text
from calibration.study.config import parse_config
from calibration.study.new.study import check_folder
from dem.errors import DemError
from dem.io.mapping import read_mapping
from dem.tables.limits import read_limited

TEXTS = (".yaml", ".yml", ".md")
"""Files in which the folder is named."""


def copy_study(folder: Path, new: Path) -> list[str]:
    """Copy a study's folder to a new one; returns sentences. Raises CalibrationError for a folder
    without a study, a new one that exists, and a copy that would not be a study, with nothing
    left."""
    name = check_folder(new)
    if not (folder / "config.yaml").is_file():
        raise CalibrationError(f"{folder}: is no study; allowed: a folder with config.yaml")
    read_mapping(folder / "config.yaml")  # what is wrong with it is told of this file
    new.mkdir(parents=True)
    try:
        for path in sorted(p for p in folder.iterdir() if p.is_file()):
            if path.suffix in TEXTS:
                write_text(_renamed(_text(path), folder, new), new / path.name)
            else:
                shutil.copyfile(path, new / path.name)
        config = new / "config.yaml"
        text = _named(_text(config), name, folder)
        write_text(text, config)
        parse_config(read_mapping(config)[0], files=[config])
    except (CalibrationError, DemError, OSError):
        shutil.rmtree(new)
        raise
    return [
        f"wrote {new}, the study {name}. Its runs are those of {folder} until something is changed"
    ]


def _text(path):
    try:
        return read_limited(path, "table").decode("utf-8")
    except ValueError:
        raise ConfigError("is no text", path=path, allowed="UTF-8") from None


def _named(text, name, folder):
    """The configuration with another name, in the words above it too. Raises ConfigError where
    its name has no line."""
    own = re.findall(r"^name:\s*['\"]?([\w-]+)", text, flags=re.M)
    if len(own) != 1:
        raise ConfigError("has no line of its name", path=folder / "config.yaml", key="name")
    text = re.sub(r"^name:.*$", f"name: {name}", text, flags=re.M)
    words = re.compile(rf"^(#.*results/){re.escape(own[0])}(?=/)", flags=re.M)
    return words.sub(rf"\g<1>{name}", text)


def _renamed(text, folder, new):
    """The text with each path into the folder as one into the new one, and its commands too."""
    old = re.escape(folder.as_posix())
    text = re.sub(rf"(?<![\w./-]){old}(?=/)", new.as_posix(), text)
    return re.sub(rf"(calibration run '?){old}(?![\w/-])", rf"\g<1>{new.as_posix()}", text)
