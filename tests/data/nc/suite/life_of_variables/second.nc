#MSG ["second: P %d, V.P %d, V.S %d", EXIST[P1], EXIST[V.P.A], EXIST[V.S.A]]
#MSG ["%d %s", V.S.A, V.S.B[1]]
#VAR
  V.S.B[2] : STRING[10]
#ENDVAR
#MSG ["declared again: %s", V.S.B[1]]
N50 #DELETE V.S.A, V.S.B
#MSG ["%d %d", EXIST[V.S.A], EXIST[V.S.B]]
N70 #DELETE V.S.A
M30
