#VAR
  V.P.A[3]
#ENDVAR
V.P.A[2] = 1
N50 V.P.A[3] = 1
M30
