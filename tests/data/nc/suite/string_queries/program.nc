V.P.S = "a"
V.P.N = 1
#MSG ["%d%d%d%d", IS_STRING[V.P.S], IS_NUMBER[V.P.S], IS_STRING[V.P.N], IS_NUMBER[V.P.N]]
#MSG ["%d%d", EXIST[V.P.S], EXIST[V.P.X]]
#MSG ["%d%d", EXIST[P1], EXIST[V.G.SERVICE.UUID]]
N60 #MSG ["%d", IS_STRING[V.P.X]]
M30
