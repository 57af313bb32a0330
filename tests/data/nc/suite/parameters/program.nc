P1 = 10 P2 = 2 * P1
P[P1 + 1] = 111
#MSG ["%d %d %d", P1, P2, P11]
P3 = 11
PP3 = 12 (P11)
P4 = 3
PPP4 = 13 (P4 -> P3 -> P11)
#MSG ["%d %d", P11, PPP4]
P1 += 5 P2 -= 5 P3 *= 2 P4 /= 2
#MSG ["%d %d %d %.1f", P1, P2, P3, P4]
M30
