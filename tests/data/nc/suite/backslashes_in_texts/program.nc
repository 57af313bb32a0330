V.P.S = "C:\parts\\"
#MSG ["%s %d", V.P.S, LEN[V.P.S]]
#MSG ["%s", "\\server\share"]
#MSG ["%s", "\\" + "\\\"x\\"]
M30
