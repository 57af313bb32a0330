N10 #MSG ["%d", "abc"]
M30
