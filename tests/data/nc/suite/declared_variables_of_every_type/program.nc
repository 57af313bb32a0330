#VAR
  V.P.A
  V.P.B : BOOLEAN = 7
  V.P.C : SGN08 = -128
  V.P.D : UNS08 = 255
  V.P.E : SGN16 = -32768
  V.P.F : UNS16 = 65535
  V.P.G : SGN32 = 1.6
  V.P.H : UNS32 = 4294967295
  V.P.I : REAL64 = 1/3
  V.P.J : STRING[5] = "abcde"
  V.P.K : STRING
  V.P.L = 20
  (a comment and an empty line)

  N99 V.P.M : UNS08 = V.P.D - 5
#ENDVAR
#MSG ["%d %d %d %d %d %d %d %d", V.P.A, V.P.B, V.P.C, V.P.D, V.P.E, V.P.F, V.P.G, V.P.H]
#MSG ["%.3f [%s] [%s] %d %d", V.P.I, V.P.J, V.P.K, V.P.L, V.P.M]
V.P.G = 2.5
V.P.B = 0.4
#MSG ["%d %d", V.P.G, V.P.B]
M30
