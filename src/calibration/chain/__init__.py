"""What the stages share: the study that each is given, what a job does around its function, the
files that several read or write, and the responses of their runs."""
