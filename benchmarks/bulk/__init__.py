"""Bulk processes of Dosta et al. (2024), Computer Physics Communications 296, 109066: a sphere that
falls into a bed and a drum that mixes, in this engine and in others.

Their authors chose the cases. The grains' places and the walls' triangles are those that they gave
out; MercuryDPM's repository has them under Drivers/Papers/OSBenchmark.
"""
