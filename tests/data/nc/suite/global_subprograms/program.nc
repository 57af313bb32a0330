N10 P1 = 1
N20 L sub.nc
N30 #MSG ["P1 = %d", P1]
N40 V.P.NAME = "sub.nc"
N50 L V.P.NAME
N60 #MSG ["P1 = %d", P1]
N70 M30
