"""A tetrahedron at the origin with edges along the axes, as files of meshes have it."""

import struct

CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def obj(size: float = 1.0) -> str:
    """Its text in an OBJ file."""
    corners = [" ".join(str(size * at) for at in corner) for corner in CORNERS]
    faces = [" ".join(str(corner + 1) for corner in face) for face in FACES]
    return "".join([*(f"v {corner}\n" for corner in corners), *(f"f {face}\n" for face in faces)])


def stl(size: float = 1.0) -> bytes:
    """Its bytes in an STL file."""
    facets = [[size * at for corner in face for at in CORNERS[corner]] for face in FACES]
    packed = b"".join(struct.pack("<12fH", 0, 0, 0, *facet, 0) for facet in facets)
    return bytes(80) + struct.pack("<I", len(FACES)) + packed
