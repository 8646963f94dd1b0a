"""`dem new`: begin a study from what a laboratory knows of its material and rig, and try it with a
few coarse heaps."""
