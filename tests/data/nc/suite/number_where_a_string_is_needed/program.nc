N10 P1 = LEN["a" + 1]
M30
