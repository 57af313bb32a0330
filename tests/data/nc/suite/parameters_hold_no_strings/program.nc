N10 P1 = "abc"
M30
