N10 L sub.nc
M30
