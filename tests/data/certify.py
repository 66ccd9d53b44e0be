"""Writes integrals.jsonl: clamped-cosine integrals of Bézier shapes to 15 digits, by mpmath at 60 digits.

An oracle of its own: roots of z(t) by polynomial root finding, arcs by Gauss-Legendre quadrature split at the
complex roots of |p|^2, closing edges by the antiderivative along the horizon. The inputs are doubles, taken exactly.
Needs mpmath from PyPI; run: python3 certify.py > integrals.jsonl
"""
import json, math, random
from mpmath import mp, mpf, atan2, atan, polyroots, quad, pi

mp.dps = 60
R = random.Random(20260)


def coefficients(v):
    d0, d1, d2 = v[1] - v[0], v[2] - v[1], v[3] - v[2]
    return [v[0], 3 * d0, 3 * (d1 - d0), d2 - 2 * d1 + d0]


def evaluate(k, t):
    return ((k[3] * t + k[2]) * t + k[1]) * t + k[0]


def slope(k, t):
    return (3 * k[3] * t + 2 * k[2]) * t + k[1]


def multiply(a, b):
    out = [mpf(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            out[i + j] += x * y
    return out


def real_cuts(k):
    k = list(k)
    largest = max(abs(c) for c in k)
    while len(k) > 1 and abs(k[-1]) <= largest * mpf(10) ** -50:
        k.pop()
    if len(k) == 1:
        return []
    return polyroots(k[::-1], maxsteps=2000, extraprec=800)


def integral(curves, c):
    c0, c1, c2 = [[mpf(x) for x in v] for v in c]
    n = [c0[1] * c1[2] - c0[2] * c1[1], c0[2] * c1[0] - c0[0] * c1[2], c0[0] * c1[1] - c0[1] * c1[0]]
    depth = -sum(a * b for a, b in zip(n, c2))
    if depth <= 0:
        return mpf(0)
    height = lambda q: c0[2] * mpf(q[0]) + c1[2] * mpf(q[1]) + c2[2]
    total = mpf(0)
    for curve in curves:
        p = [[c0[i] * mpf(q[0]) + c1[i] * mpf(q[1]) + c2[i] for q in curve] for i in range(3)]
        kx, ky, kz = [coefficients(v) for v in p]
        square = [a + b + d for a, b, d in zip(multiply(kx, kx), multiply(ky, ky), multiply(kz, kz))]
        cuts = [r.real for r in real_cuts(kz) if abs(r.imag) < mpf(10) ** -25 and 0 < r.real < 1]
        stops = sorted(set([mpf(0), mpf(1)] + cuts))
        above = lambda t: evaluate(kz, t) > 0
        near = []
        for r in real_cuts(square):
            for s in (r.real, r.real - abs(r.imag), r.real + abs(r.imag), r.real - 10 * abs(r.imag), r.real + 10 * abs(r.imag),
                      r.real - 100 * abs(r.imag), r.real + 100 * abs(r.imag)):
                if 0 < s < 1:
                    near.append(s)
        f = lambda t: (slope(kx, t) * evaluate(ky, t) - slope(ky, t) * evaluate(kx, t)) / (
            evaluate(kx, t) ** 2 + evaluate(ky, t) ** 2 + evaluate(kz, t) ** 2)
        # Shared end points are judged from the point itself, so that the two curves that meet there agree.
        start, end = height(curve[0]) > 0, height(curve[3]) > 0
        inside = [above((a + b) / 2) for a, b in zip(stops, stops[1:])]
        states = [start] + inside + [end]
        for k, (a, b) in enumerate(zip(stops, stops[1:])):
            if inside[k]:
                mids = sorted([a, b] + [s for s in near if a < s < b])
                total += quad(f, mids)
        for k in range(len(states) - 1):
            if states[k] != states[k + 1]:
                t = stops[k]
                x, y = evaluate(kx, t), evaluate(ky, t)
                phi = atan((n[0] * y - n[1] * x) / depth)
                total += phi if states[k + 1] else -phi
    return total / (2 * pi)


def ring(center, radius, n, hole=False):
    pts = []
    for i in range(n):
        a = (i + R.uniform(-.3, .3)) / n * 2 * math.pi
        r = radius * R.uniform(.6, 1)
        pts.append((center[0] + r * math.cos(a), center[1] + r * math.sin(a)))
    out = []
    for i in range(n):
        a, b = pts[i], pts[(i + 1) % n]
        d = (b[0] - a[0], b[1] - a[1])
        side = (d[1], -d[0])
        at = lambda t, s: (a[0] + d[0] * t + side[0] * s, a[1] + d[1] * t + side[1] * s)
        kind = R.randrange(4)
        if kind == 0:
            h = at(1 / 3, 0), at(2 / 3, 0)
        elif kind == 1:
            q = at(.5, R.uniform(-.1, .3))
            h = (tuple(a[i] + (q[i] - a[i]) * 2 / 3 for i in (0, 1)), tuple(b[i] + (q[i] - b[i]) * 2 / 3 for i in (0, 1)))
        elif kind == 2:
            h = at(.3, .2), at(.7, -R.uniform(-.2, .2))
        else:
            h = at(.2, .3), b
        out.append([list(a), list(h[0]), list(h[1]), list(b)])
    if hole:
        out = [c[::-1] for c in out[::-1]]
    return out


def rotation():
    q = [R.gauss(0, 1) for _ in range(4)]
    s = math.sqrt(sum(x * x for x in q))
    w, x, y, z = [v / s for v in q]
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def lobe(alpha):
    """M^-1 for M = R_y(p) [[alpha, 0, alpha s], [0, alpha b, 0], [0, 0, 1]], up to rounding."""
    p, s, b = R.uniform(-1.5, 0), R.uniform(-.5, .5), R.uniform(.3, 1)
    cp, sp = math.cos(p), math.sin(p)
    xx, xz, zx, zz = cp * alpha, cp * alpha * s + sp, -sp * alpha, -sp * alpha * s + cp
    det = xx * zz - xz * zx
    return [[zz / det, 0, -xz / det], [0, 1 / (alpha * b), 0], [-zx / det, 0, xx / det]]


def apply(m, v):
    return [sum(m[i][j] * v[j] for j in range(3)) for i in range(3)]


def case(kind, i):
    curves = ring((0, 0), 1, 3 + R.randrange(6))
    if R.random() < .5:
        curves += ring((.05, -.03), .3, 4, hole=True)
    r = rotation()
    x, y, z = [[r[k][j] for k in range(3)] for j in range(3)]
    on = lambda q: [x[k] * q[0] + y[k] * q[1] for k in range(3)]
    direction = [v / 2 for v in [R.gauss(0, 1) for _ in range(3)]]
    origin = [v * math.exp(R.uniform(-2, 2)) for v in direction]
    m = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    corner = curves[R.randrange(len(curves))][0]
    if kind == "lobe":
        m = lobe(math.exp(R.uniform(math.log(1e-2), 0)))
    if kind == "mirror":
        m = lobe(math.exp(R.uniform(math.log(1e-4), math.log(1e-2))))
    if kind == "contact":
        origin = [-a + b * 10 ** R.uniform(-5, -2) for a, b in zip(on(corner), direction)]
        m = m if R.random() < .5 else lobe(math.exp(R.uniform(math.log(1e-2), 0)))
    if kind == "plane":
        q = [R.uniform(-2, 2), R.uniform(-2, 2)]
        origin = [-a - b * 10 ** R.uniform(-9, -3) for a, b in zip(on(q), z)]
    if kind == "corner":
        origin[2] = -on(corner)[2]
    if kind == "tangent":
        lowest = min(sum(on(q)[2] for q in [[((1 - t) ** 3) * c[0][j] + 3 * t * (1 - t) ** 2 * c[1][j] + 3 * t * t * (1 - t) * c[2][j]
                     + t ** 3 * c[3][j] for j in (0, 1)]]) for c in curves for t in [k / 4000 for k in range(4001)])
        origin[2] = -lowest + R.uniform(-1, 1) * 1e-8
    scale = {"small": 1e-4, "large": 1e4}.get(kind, 1)
    curves = [[[a * scale for a in q] for q in c] for c in curves]
    origin = [v * scale for v in origin]
    # Seen from the front, mostly.
    normal = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]]
    if sum(a * b for a, b in zip(normal, origin)) > 0 and R.random() < .9 and kind not in ("plane", "contact"):
        origin = [-v for v in origin]
    c = [apply(m, x), apply(m, y), apply(m, origin)]
    return {"id": f"{kind}-{i}", "curves": curves, "c0": c[0], "c1": c[1], "c2": c[2]}


if __name__ == "__main__":
    for kind in ("lambert", "lobe", "mirror", "contact", "plane", "corner", "tangent", "small", "large"):
        for i in range(24):
            record = case(kind, i)
            record["value"] = float(integral(record["curves"], [record["c0"], record["c1"], record["c2"]]))
            print(json.dumps(record), flush=True)
