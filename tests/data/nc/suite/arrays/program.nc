#VAR
  V.P.A[3] = [1, 2, 3]
  V.P.B[2][3] : SGN32 = [11, 12, 13], \
                        [21, 22, 23]
  V.P.C[2][2] = [[1, 2], [3, 4]]
  V.P.D[4] : STRING[8] = ["one", "two"]
  V.P.E[1][2][3][4] : UNS08
  P10[2][2] = [1.5, 2.5, 3.5, 4.5]
#ENDVAR
#MSG ["%d %d %d", V.P.A[0], V.P.A[1], V.P.A[2]]
P1 = 1
#MSG ["%d %d", V.P.B[P1][P1 + 1], V.P.B[0][0]]
#MSG ["%d %d", V.P.C[0][1], V.P.C[1][0]]
#MSG ["[%s] [%s] [%s]", V.P.D[0], V.P.D[1], V.P.D[2]]
V.P.E[0][1][2][3] = 255
#MSG ["%d", V.P.E[0][1][2][3]]
#MSG ["%.1f %.1f", P10[0][1], P10[P1][1]]
P10[1][1] += 1
V.P.A[2] = V.P.A[1] * 10
#MSG ["%.1f %d", P10[1][1], V.P.A[2]]
#MSG ["sizes %d %d %d %d", SIZEOF[V.P.A], SIZEOF[V.P.B, 2], SIZEOF[V.P.E, 4], SIZEOF[V.P.E, 5]]
#MSG ["no dimension %d", SIZEOF[V.P.A, 0]]
M30
