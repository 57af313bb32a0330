%L SUB
#MSG ["exists %d", EXIST[V.L.A]]
#VAR
  V.L.A = 2
#ENDVAR
#MSG ["sub %d", V.L.A]
M17
%MAIN
#VAR
  V.L.A = 1
#ENDVAR
LL SUB
#MSG ["main %d", V.L.A]
N90 V.L.B = 1
M30
