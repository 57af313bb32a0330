N10 L sub.nc
N20 #MSG ["never"]
M30
