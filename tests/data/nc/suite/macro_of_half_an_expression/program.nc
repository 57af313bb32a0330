"A" = "COS["
N20 P1 = 2 * "A"
M30
