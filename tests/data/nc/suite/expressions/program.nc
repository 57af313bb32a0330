#MSG ["%d %d %d %d", 1 + 2 * 3, [1 + 2] * 3, 2 ** 3 ** 2, -2 ** 2]
#MSG ["%d %d %d %.2f", 11 MOD 3, -11 MOD 3, 7 - 2 - 1, 7 / 2]
#MSG ["%d%d%d%d%d%d", 1 == 1, 1 != 1, 1 < 2, 2 <= 1, 2 > 1, 1 >= 2]
#MSG ["%d%d%d%d", TRUE && FALSE, TRUE || FALSE, 1 AND 1, 0 OR 0]
#MSG ["%d%d%d%d", TRUE XOR TRUE, 1 XOR 0, NOT[1], !0]
#MSG ["%d %d %d %d", 12 & 10, 12 | 10, 12 ^ 10, INV[0]]
#MSG ["%d %d", 1 + 1 == 2 && 3 > 2, 1 || 0 && 0]
#MSG ["%d", - -5]
M30
