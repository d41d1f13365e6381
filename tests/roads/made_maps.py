"""Small made maps, written as real .osm.pbf, .osm and .osm.gz files."""

import gzip
import struct
from xml.sax.saxutils import quoteattr

from mapfilter.geodesy import unproject

CRS = "EPSG:32629"
ORIGIN = (531_000.0, 4_556_000.0)

AREA = (CRS, (ORIGIN[0], ORIGIN[1], ORIGIN[0] + 400.0, ORIGIN[1] + 400.0))
"""A box of 400 m with ORIGIN at its south-western corner."""


def write_pbf(path, ways, relations=()):
    """Write ways ``(id, tags, [(east, north), ...])`` as an .osm.pbf; equal corners share a node.

    Metres are counted from ORIGIN. Relations are ``(id, tags, [way ids])``, outer rings all.
    """
    from pyrosm.proto import fileformat_pb2, osmformat_pb2

    block = osmformat_pb2.PrimitiveBlock()
    texts = [""]

    def text(value):
        if value not in texts:
            texts.append(value)
        return texts.index(value)

    nodes = {}
    for _, _, corners in ways:
        for corner in corners:
            nodes.setdefault(corner, len(nodes) + 1)
    group = block.primitivegroup.add()
    lon, lat = unproject(CRS, [ORIGIN[0] + x for x, _ in nodes], [ORIGIN[1] + y for _, y in nodes])
    last = (0, 0, 0)
    for number, x, y in zip(nodes.values(), lon, lat, strict=True):
        now = (number, round(y * 1e7), round(x * 1e7))
        group.dense.id.append(now[0] - last[0])
        group.dense.lat.append(now[1] - last[1])
        group.dense.lon.append(now[2] - last[2])
        last = now
    group = block.primitivegroup.add()
    for way_id, tags, corners in ways:
        way = group.ways.add(id=way_id)
        for key, value in tags.items():
            way.keys.append(text(key))
            way.vals.append(text(value))
        before = 0
        for corner in corners:
            way.refs.append(nodes[corner] - before)
            before = nodes[corner]
    if relations:
        group = block.primitivegroup.add()
    for relation_id, tags, members in relations:
        relation = group.relations.add(id=relation_id)
        for key, value in {"type": "multipolygon", **tags}.items():
            relation.keys.append(text(key))
            relation.vals.append(text(value))
        before = 0
        for member in members:
            relation.roles_sid.append(text("outer"))
            relation.memids.append(member - before)
            relation.types.append(1)
            before = member
    block.stringtable.s.extend(value.encode() for value in texts)

    header = osmformat_pb2.HeaderBlock(required_features=["OsmSchema-V0.6", "DenseNodes"])
    with path.open("wb") as stream:
        for kind, message in (("OSMHeader", header), ("OSMData", block)):
            body = fileformat_pb2.Blob(raw=message.SerializeToString()).SerializeToString()
            head = fileformat_pb2.BlobHeader(type=kind, datasize=len(body)).SerializeToString()
            stream.write(struct.pack(">I", len(head)) + head + body)
    return path


def write_xml(path, ways, relations=(), bounds=None):
    """Write what :func:`write_pbf` writes as .osm, or by the path's suffix as .osm.gz."""
    nodes = {}
    for _, _, corners in ways:
        for corner in corners:
            nodes.setdefault(corner, len(nodes) + 1)
    lon, lat = unproject(CRS, [ORIGIN[0] + x for x, _ in nodes], [ORIGIN[1] + y for _, y in nodes])
    lines = ["<?xml version='1.0' encoding='UTF-8'?>", '<osm version="0.6" generator="made">']
    if bounds is not None:
        west, south, east, north = bounds
        lines.append(f'<bounds minlat="{south}" minlon="{west}" maxlat="{north}" maxlon="{east}"/>')
    for number, x, y in zip(nodes.values(), lon, lat, strict=True):
        lines.append(f'<node id="{number}" lat="{y:.7f}" lon="{x:.7f}"/>')

    def tags(given):
        return [f"<tag k={quoteattr(k)} v={quoteattr(v)}/>" for k, v in given.items()]

    for way_id, given, corners in ways:
        refs = [f'<nd ref="{nodes[corner]}"/>' for corner in corners]
        lines += [f'<way id="{way_id}">', *refs, *tags(given), "</way>"]
    for relation_id, given, members in relations:
        inner = [f'<member type="way" ref="{member}" role="outer"/>' for member in members]
        given = {"type": "multipolygon", **given}
        lines += [f'<relation id="{relation_id}">', *inner, *tags(given), "</relation>"]
    content = "\n".join([*lines, "</osm>", ""]).encode()
    path.write_bytes(gzip.compress(content, mtime=0) if path.suffix == ".gz" else content)
    return path
