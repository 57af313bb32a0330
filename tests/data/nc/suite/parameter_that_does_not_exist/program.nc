N10 P1 = 1
N20 #MSG ["%d", P2]
M30
