"""Puts the texture of one mesh onto another, with trimesh.

    pip install ./python trimesh pillow
    python examples/python/transfer_texture.py scan.obj textured.glb scan_textured.glb

Where the second mesh has no texture, a checkerboard is laid over it first, so that one sees what became of it.
"""

import argparse

import fmnet
import numpy as np
import trimesh
from PIL import Image


def load(path):
    """The one mesh of a file, with the vertices of the file: trimesh would merge and reorder them otherwise."""
    return trimesh.load(path, process=False, force="mesh")


def checkerboard(mesh):
    """Texture coordinates from the front and an image of squares."""
    low, high = mesh.bounds
    uv = ((mesh.vertices - low) / (high - low))[:, :2]
    squares = np.indices((16, 16)).sum(axis=0) % 2
    image = Image.fromarray((80 + 150 * squares).astype(np.uint8)).resize((512, 512), Image.Resampling.NEAREST)
    return uv, image.convert("RGB")


def texture_of(mesh):
    """Texture coordinates [n, 2] and the image."""
    uv = getattr(mesh.visual, "uv", None)
    material = getattr(mesh.visual, "material", None)
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    return (uv, image) if uv is not None and image is not None else checkerboard(mesh)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("receiver", help="mesh that receives")
    parser.add_argument("giver", help="mesh with the texture")
    parser.add_argument("out", help="the receiver with the texture, .glb or .obj")
    arguments = parser.parse_args()

    receiver, giver = load(arguments.receiver), load(arguments.giver)
    uv, image = texture_of(giver)
    match = fmnet.match(receiver, giver)
    corner_uvs = fmnet.transfer_uvs(np.asarray(uv)[giver.faces], match, receiver, giver)

    # A triangle beside a seam has texture coordinates of its own, and trimesh has them by vertex: each corner becomes one.
    corners = trimesh.Trimesh(
        vertices=receiver.vertices[receiver.faces].reshape(-1, 3),
        faces=np.arange(3 * len(receiver.faces)).reshape(-1, 3),
        vertex_normals=receiver.vertex_normals[receiver.faces].reshape(-1, 3),
        visual=trimesh.visual.TextureVisuals(uv=corner_uvs.reshape(-1, 2), image=image),
        process=False,
    )
    corners.export(arguments.out)
    print(f"{len(receiver.faces)} triangles textured; {arguments.out} written")


if __name__ == "__main__":
    main()
