#VAR
  V.P.A : STRING[5]
#ENDVAR
V.P.A = "abcde"
N50 V.P.A = V.P.A + "f"
M30
