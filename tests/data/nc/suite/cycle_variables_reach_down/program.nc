%L INNER
#MSG ["inner %d", V.CYC.A]
V.CYC.A = 3
M17
%L OUTER
#VAR
  V.CYC.A = 2
#ENDVAR
LL INNER
#MSG ["outer %d", V.CYC.A]
M17
%MAIN
LL OUTER
#MSG ["exists %d", EXIST[V.CYC.A]]
M30
