#!/usr/bin/env python3
"""Writes shelf.glb beside itself: a bookshelf of bevelled boards with a wood texture and a normal map, and a metal block.

The boards are boxes whose bevels blend the normals of the faces that they join. Only the standard library; the same
bytes for the same zlib. Run: python3 tests/data/scenes/shelf.py
"""
import json, math, pathlib, struct, zlib

BEVEL = 0.006  # metres


def png(width, height, pixel):
    rows = b"".join(b"\0" + b"".join(bytes(pixel(x, y)) for x in range(width)) for y in range(height))
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


SIDE = 64


def grain(x, y):
    """Height of the wood, 0 to 1; repeats over the texture. Grain runs along u."""
    u, v = x / SIDE * math.tau, y / SIDE * math.tau
    rings = math.sin(4 * v + 0.9 * math.sin(u) + 0.4 * math.sin(2 * u + 2 * v))
    fine = math.sin(16 * v + 1.5 * math.sin(u + 3 * v))
    return 0.5 + 0.35 * rings + 0.15 * fine


def wood(x, y):
    h = grain(x, y)
    return [round(a + (b - a) * h) for a, b in zip((112, 66, 34), (190, 132, 80))]


def bumps(x, y):
    dx = (grain(x + 1, y) - grain(x - 1, y)) * 0.9
    dy = (grain(x, y + 1) - grain(x, y - 1)) * 0.9
    n = (-dx, dy, 1.0)  # green is up in the image, y is down
    length = math.sqrt(sum(c * c for c in n))
    return [round((c / length * 0.5 + 0.5) * 255) for c in n]


def rough(x, y):
    return [255, round(150 + 90 * grain(x, y)), 0]


def box(w, h, d):
    """Positions, normals, uvs (one repeat per 0.4 m) and indices of a bevelled box about the origin."""
    half = (w / 2, h / 2, d / 2)
    position, normal, uv, index = [], [], [], []
    at = {}
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    for corner in corners:
        for axis in range(3):
            p = [corner[k] * (half[k] - (0 if k == axis else BEVEL)) for k in range(3)]
            n = [0, 0, 0]
            n[axis] = corner[axis]
            # The longest of the two other axes carries u, so that the grain runs along the board.
            others = sorted((k for k in range(3) if k != axis), key=lambda k: -half[k])
            at[corner, axis] = len(position)
            position.append(p)
            normal.append(n)
            uv.append([p[others[0]] / 0.4 + 0.37 * axis, -p[others[1]] / 0.4])

    def face(ids):
        """Adds a convex polygon, wound so that it faces outwards."""
        a, b, c = (position[i] for i in ids[:3])
        e, f = [b[k] - a[k] for k in range(3)], [c[k] - a[k] for k in range(3)]
        cross = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]]
        if sum(cross[k] * sum(position[i][k] for i in ids) for k in range(3)) < 0:
            ids = ids[::-1]
        for k in range(1, len(ids) - 1):
            index.extend((ids[0], ids[k], ids[k + 1]))

    for axis in range(3):
        u, v = [k for k in range(3) if k != axis]
        for side in (-1, 1):
            def corner(a, b):
                c = [0, 0, 0]
                c[axis], c[u], c[v] = side, a, b
                return tuple(c)
            face([at[corner(a, b), axis] for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
        for a in (-1, 1):
            for b in (-1, 1):
                def end(s):
                    c = [0, 0, 0]
                    c[axis], c[u], c[v] = s, a, b
                    return tuple(c)
                face([at[end(-1), u], at[end(1), u], at[end(1), v], at[end(-1), v]])
    for c in corners:
        face([at[c, 0], at[c, 1], at[c, 2]])
    return position, normal, uv, index


binary = bytearray()
doc = {
    "asset": {"version": "2.0", "generator": "tests/data/scenes/shelf.py"},
    "scene": 0,
    "scenes": [{"nodes": [0]}],
    "nodes": [{"name": "shelf", "children": []}],
    "meshes": [],
    "materials": [
        {
            "name": "wood",
            "pbrMetallicRoughness": {
                "baseColorTexture": {"index": 0},
                "metallicRoughnessTexture": {"index": 1},
                "metallicFactor": 0.0,
                "roughnessFactor": 0.8,
            },
            "normalTexture": {"index": 2, "scale": 0.7},
        },
        {
            "name": "brass",
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.887, 0.789, 0.434, 1.0],
                "metallicFactor": 1.0,
                "roughnessFactor": 0.4,
            },
        },
    ],
    "textures": [{"source": k, "sampler": 0} for k in range(3)],
    "samplers": [{"wrapS": 10497, "wrapT": 10497}],
    "images": [],
    "accessors": [],
    "bufferViews": [],
}


def view(data):
    while len(binary) % 4:
        binary.append(0)
    doc["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
    binary.extend(data)
    return len(doc["bufferViews"]) - 1


def accessor(values, kind):
    if kind == "SCALAR":
        data, component = struct.pack(f"<{len(values)}H", *values), 5123
    else:
        data, component = b"".join(struct.pack(f"<{len(v)}f", *v) for v in values), 5126
    entry = {"bufferView": view(data), "componentType": component, "count": len(values), "type": kind}
    if kind == "VEC3":
        single = [struct.unpack("<3f", struct.pack("<3f", *v)) for v in values]
        entry["min"] = [min(v[k] for v in single) for k in range(3)]
        entry["max"] = [max(v[k] for v in single) for k in range(3)]
    doc["accessors"].append(entry)
    return len(doc["accessors"]) - 1


def mesh(name, size, material):
    position, normal, uv, index = box(*size)
    doc["meshes"].append({
        "name": name,
        "primitives": [{
            "attributes": {
                "POSITION": accessor(position, "VEC3"),
                "NORMAL": accessor(normal, "VEC3"),
                "TEXCOORD_0": accessor(uv, "VEC2"),
            },
            "indices": accessor(index, "SCALAR"),
            "material": material,
        }],
    })
    return len(doc["meshes"]) - 1


def node(name, which, translation, **more):
    doc["nodes"].append({"name": name, "mesh": which, "translation": translation, **more})
    doc["nodes"][0]["children"].append(len(doc["nodes"]) - 1)


side = mesh("side", (0.03, 1.0, 0.3), 0)
board = mesh("board", (1.14, 0.03, 0.29), 0)
back = mesh("back", (1.14, 1.0, 0.02), 0)
block = mesh("block", (0.2, 0.14, 0.14), 1)
node("left", side, [-0.585, 0.5, 0.0])
node("right", side, [0.585, 0.5, 0.0])
for k, y in enumerate((0.015, 0.36, 0.7, 0.985)):
    node(f"board {k}", board, [0.0, y, 0.0])
node("back", back, [0.0, 0.5, -0.14])
angle = math.radians(25) / 2
node("block", block, [0.25, 0.445, 0.02], rotation=[0.0, math.sin(angle), 0.0, math.cos(angle)])

for name, pixel in (("wood", wood), ("rough", rough), ("bumps", bumps)):
    doc["images"].append({"name": name, "bufferView": view(png(SIDE, SIDE, pixel)), "mimeType": "image/png"})
doc["buffers"] = [{"byteLength": len(binary)}]

text = json.dumps(doc, separators=(",", ":")).encode()
text += b" " * (-len(text) % 4)
binary += b"\0" * (-len(binary) % 4)
glb = struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(binary))
glb += struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
pathlib.Path(__file__).with_name("shelf.glb").write_bytes(glb)
