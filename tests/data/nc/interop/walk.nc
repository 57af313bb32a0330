; Makes a variable of each family, and waits, so that an ADS client can look at them.
#VAR
  V.P.TABLE[2] : SGN16 = [7, -8]
  V.P.TEXT : STRING[20] = "part"
  V.S.KEPT : UNS32 = 9
  V.L.HERE = 1.5
  V.CYC.LEVEL = 2
#ENDVAR
P12 = 3.25
N100 G00 X10 Y-20
#FLUSH WAIT
#WAIT FOR V.E.GO == 1
M30
