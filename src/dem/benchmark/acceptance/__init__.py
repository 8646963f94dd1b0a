"""Whether a changed engine may take the place of another: `dem accept OLD NEW`.

Bits change with the order in which floats are summed, so no number of a run is compared by itself.
The new engine must pass its verification tests, which hold closed forms. And the two engines make
the same runs (`trials`), whose results may differ by no more than margins that stand there.
"""
