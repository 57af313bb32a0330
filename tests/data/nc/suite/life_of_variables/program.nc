#MSG ["first: P %d, V.P %d, V.S %d", EXIST[P1], EXIST[V.P.A], EXIST[V.S.A]]
P1 = 1
V.P.A = 2
V.S.A = 3
#VAR
  V.S.B[2] : STRING[10] = ["a", "b"]
#ENDVAR
M30
