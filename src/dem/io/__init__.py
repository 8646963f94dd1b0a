"""Files that are read and written whole: YAML with lines, arrays, frames, checksums."""
