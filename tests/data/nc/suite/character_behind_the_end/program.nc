N10 P1 = ORD["abc", 4]
M30
