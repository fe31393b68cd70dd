//! What is fuzzed: readers with valid files to start from.

use crate::mutate::mutated;
use candle_core::Device;
use fmnet::cache::{Cache, Lookup};
use fmnet::descriptor::ShotOptions;
use fmnet::events::ignore;
use fmnet::io::{
    Attributes, IntegerField, IntegerKind, Joint, NpyArray, NpyKind, Skin, Texture, decode_mesh,
    read_landmarks, read_matrix, read_npy, read_point_map, read_surface_points, read_vector, write_matrix,
    write_mesh, write_npy, write_point_map, write_surface_points,
};
use fmnet::mesh::shapes::{bumpy_sphere, grid, joined};
use fmnet::mesh::{SurfacePoint, inspect};
use fmnet::network::contract::ModelInput;
use fmnet::network::{Backend, DescriptorNetwork};
use fmnet::pipeline::{DescribedShape, DescriptorKind, MatchOptions, Matcher, Resize};
use fmnet::point_map::PointMap;
use fmnet::shape::{Context, Shape, ShapeOptions};
use fmnet::{Matrix, Mesh};
use fmnet_tests::test_metadata;
use fmnet_trainer::checkpoint::Checkpoint;
use fmnet_trainer::config::TrainConfig;
use fmnet_trainer::dataset::{Correspondence, Dataset, ShapeEntry, Split};
use fmnet_trainer::export::to_onnx;
use fmnet_trainer::network::{
    DiffusionNetwork, DiffusionOptions, Network, NetworkOptions, ResidualNetwork, ResidualOptions,
    parameter_values,
};
use fmnet_trainer::optimizer::AdamState;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::path::{Path, PathBuf};

/// Every target.
pub(super) const NAMES: [&str; 22] = [
    "off",
    "ply",
    "obj",
    "mtl",
    "gltf",
    "glb",
    "stl",
    "shape",
    "map.txt",
    "map.vts",
    "map.npy",
    "map.csv",
    "matrix.npy",
    "model",
    "dataset.toml",
    "baryc_gt",
    "corr",
    "config.toml",
    "checkpoint",
    "cache",
    "landmarks",
    "described",
];

/// Takes a file's bytes; whether the reader accepted them.
type Run = Box<dyn Fn(&[u8]) -> bool>;

/// A reader with valid files.
pub(super) struct Target {
    pub(super) seeds: Vec<Vec<u8>>,
    /// Bytes that any input may take.
    pub(super) memory: usize,
    /// Bytes that an input may take for each of its own.
    pub(super) memory_per_byte: usize,
    /// Runs the reader; whether it took the file.
    pub(super) run: Run,
}

impl Target {
    fn new(seeds: Vec<Vec<u8>>, run: impl Fn(&[u8]) -> bool + 'static) -> Self {
        Self { seeds, memory: 8 << 20, memory_per_byte: 400, run: Box::new(run) }
    }

    fn with_memory(self, memory: usize) -> Self {
        Self { memory, ..self }
    }

    /// The seeds themselves, then changed ones without end.
    pub(super) fn input(&self, seed: u64, index: u64) -> Vec<u8> {
        if let Some(unchanged) = self.seeds.get(index as usize) {
            return unchanged.clone();
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ index);
        mutated(&self.seeds[index as usize % self.seeds.len()], &self.seeds, &mut rng)
    }
}

/// A target by its name; `folder` is for its files.
pub(super) fn make(name: &str, folder: &Path) -> Target {
    std::fs::create_dir_all(folder).unwrap();
    match name {
        "off" | "ply" | "obj" | "gltf" | "glb" | "stl" => meshes(name, folder),
        "mtl" => materials(folder),
        "shape" => shapes(folder),
        "map.txt" | "map.vts" | "map.npy" | "map.csv" => maps(name, folder),
        "matrix.npy" => matrices(folder),
        "model" => models(),
        "dataset.toml" => manifests(folder),
        "baryc_gt" => barycentric(folder),
        "corr" => surface_points(folder),
        "config.toml" => configs(folder),
        "checkpoint" => checkpoints(folder),
        "cache" => cache_entries(folder),
        "landmarks" => landmarks(folder),
        "described" => described(),
        _ => panic!("there is no target {name}"),
    }
}

/// Two triangles with every attribute.
fn decorated() -> (Mesh, Attributes) {
    let vertices = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.1], [1.0, 1.0, 0.5]];
    let mesh = Mesh::new(vertices, vec![[0, 1, 2], [2, 1, 3]]).unwrap();
    let frame = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    let joint = |parent| Joint { name: "j".into(), parent, frame };
    let attributes = Attributes {
        vertex_colors: Some(vec![[1, 2, 3, 4], [255, 0, 0, 255], [0, 128, 0, 255], [0; 4]]),
        corner_uvs: Some(vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[0.5, 0.5], [1.0, 0.0], [0.5, 0.25]]]),
        texture: Some(Texture::Embedded { bytes: vec![0x89, b'P', b'N', b'G'], mime: "image/png".into() }),
        vertex_scalars: vec![("f".into(), vec![0.0, 1.0, 2.0, 3.0])],
        vertex_integers: vec![IntegerField {
            name: "label".into(),
            kind: IntegerKind::I16,
            values: vec![-7, 0, 300, 12345],
        }],
        skin: Some(Skin {
            joints: vec![joint(None), joint(Some(0))],
            indices: vec![[0, 1, 0, 0]; 4],
            weights: vec![[0.5, 0.5, 0.0, 0.0]; 4],
        }),
    };
    (mesh, attributes)
}

/// Files of one format as the writers here write them, and as others do.
fn seeds_of(extension: &str, folder: &Path) -> Vec<Vec<u8>> {
    let path = folder.join(format!("seed.{extension}"));
    let mut seeds: Vec<Vec<u8>> = variants(extension);
    if !matches!(extension, "gltf" | "stl") {
        let (mesh, attributes) = decorated();
        for (mesh, attributes) in [(mesh, attributes), (bumpy_sphere(1, 1), Attributes::default())] {
            write_mesh(&path, &mesh, &attributes).unwrap();
            seeds.push(std::fs::read(&path).unwrap());
        }
    }
    seeds
}

fn variants(extension: &str) -> Vec<Vec<u8>> {
    let text = |text: &str| text.as_bytes().to_vec();
    match extension {
        "off" => vec![
            text(
                "STCNOFF\n3 1 0\n0 0 0 0 0 1 1 0 0 1 0 0\n1 0 0 0 0 1 0 1 0 1 1 0\n0 1 0 0 0 1 0 0 1 1 0 1\n3 0 1 2\n",
            ),
            text(
                "OFF # by hand\n4 3 0\n0 0 0\n1 0 0\n1.5D0 1 0\n0 1 0\n3 0 1 2 255 0 0\n3 0 2 3 0 0 1 1\n3 0 1 3 7\n",
            ),
            utf16("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
        ],
        "ply" => vec![
            big_endian_ply(),
            text(
                "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 3\nproperty float x\nproperty double y\n\
             property short z\nproperty list uchar int l\nelement tristrips 1\nproperty list int int vertex_indices\n\
             element face 1\nproperty list uint8 int32 vertex_index\nproperty list uchar float texcoord\nend_header\n\
             0 0 0 0\n1 2 3 2 4 5\n7 1 0 1 2\n4 0 1 2 -1\n3 0 1 2 6 0 0 1 0 0 1\n",
            ),
            text(
                "ply\nformat ascii 1.0\ncomment TextureFile a.png\ncomment TextureFile b.png\nelement vertex 3\nproperty float x\n\
             property float y\nproperty float z\nproperty short red\nproperty short green\nproperty short blue\nproperty int label\n\
             element face 1\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty int texnumber\n\
             property float red\nproperty float green\nproperty float blue\nelement edge 1\nproperty int a\nend_header\n\
             0 0 0 1 2 3 7\n1 0 0 4 5 6 8\n0 1 0 0 0 0 -9\n3 0 1 2 6 0 0 1 0 0 1 1 0.5 1 0\n5\n",
            ),
        ],
        "obj" => vec![
            text(
                "#MRGB ff112233ff445566ff778899\nmtllib a.mtl \"b c.mtl\"\ng arm #1\nv 0 0 0 1\nv 1 0 0 2\nv 0 1 0\nusemtl skin #1\n\
                 f 1 2 3\nl 1 2\ncurv 0 1 1 2\n",
            ),
            text(
                "o a\nv 0 0 0\nv 1 0 0 1 0 1\nv 1 1 0\nv 0 1 0\nvt 0 1\nvn 0 0 1\nf -1/-1/1 -2/1 1//1 \\\n2\nusemtl a\nf 1 2 3 4\n",
            ),
        ],
        "stl" => {
            let mut binary = vec![b' '; 80];
            binary.extend([2, 0, 0, 0]);
            binary.extend([0; 100]);
            let ascii = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
            let mut uncounted = binary.clone();
            uncounted[80] = 0;
            uncounted.extend(b"made by a scanner");
            vec![binary, text(ascii), uncounted, utf16(&ascii.replace("end", "END "))]
        }
        "gltf" => vec![
            text(INSTANCES),
            text(
                r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"children": [1], "rotation": [0, 0, 0, 1], "scale": [1, 2, 1]}, {"mesh": 0, "skin": 0, "matrix":
            [1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}], "skins": [{"joints": [0, 1]}],
            "buffers": [{"byteLength": 12, "uri": "data:;base64,AAAAAAAAAAAAAAAA"}],
            "bufferViews": [{"buffer": 0, "byteLength": 12, "byteOffset": 0, "byteStride": 12},
            {"buffer": 0, "byteLength": 12}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 1, "sparse": {"count": 1,
            "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": 0}}},
            {"bufferView": 1, "byteOffset": 0, "componentType": 5121, "type": "SCALAR", "count": 3}],
            "images": [{"uri": "a.png"}], "textures": [{"source": 0}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 5, "material": 0, "indices": 1}]}]}"#,
            ),
        ],
        _ => Vec::new(),
    }
}

/// Morph targets, instances, two sets of joints, a placed texture, a material of another model.
const INSTANCES: &str = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1]}, {"nodes": [2]}],
    "extensionsUsed": ["EXT_mesh_gpu_instancing", "KHR_texture_transform", "MADE_up"],
    "nodes": [{"mesh": 0, "skin": 0, "weights": [0.5], "extensions": {"EXT_mesh_gpu_instancing": {"attributes":
    {"TRANSLATION": 0, "ROTATION": 2, "SCALE": 0}}}}, {"name": "joint"}, {"mesh": 0, "name": "hidden"}],
    "skins": [{"joints": [1]}],
    "buffers": [{"byteLength": 24, "uri": "data:;base64,AAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAA"}],
    "bufferViews": [{"buffer": 0, "byteLength": 24}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 2},
    {"bufferView": 0, "componentType": 5123, "type": "VEC2", "count": 2, "byteOffset": 4},
    {"bufferView": 0, "componentType": 5122, "normalized": true, "type": "VEC4", "count": 2},
    {"bufferView": 0, "componentType": 5121, "type": "VEC4", "count": 2, "byteOffset": 12},
    {"bufferView": 0, "componentType": 5121, "type": "SCALAR", "count": 2}],
    "textures": [{"extensions": {"EXT_texture_webp": {"source": 0}}}], "images": [{"bufferView": 0, "mimeType": "image/webp"}],
    "materials": [{"name": "m", "normalTexture": {"index": 0}, "pbrMetallicRoughness": {"baseColorFactor": [0.5, 1, 0, 1]},
    "extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [1, 0, 1, 1], "diffuseTexture": {"index": 0,
    "extensions": {"KHR_texture_transform": {"offset": [0.5, 0], "rotation": 1, "scale": [2, 2], "texCoord": 0}}}}}}],
    "meshes": [{"weights": [1], "primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_1": 1, "_LABEL": 4, "_PAIR": 1, "COLOR_0": 0}, "mode": 5, "material": 0,
    "targets": [{"POSITION": 0}]}]}], "animations": [], "cameras": []}"#;

/// As UTF-16 with a byte-order mark.
fn utf16(text: &str) -> Vec<u8> {
    [0xFEFF].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect()
}

fn big_endian_ply() -> Vec<u8> {
    let header = "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty double y\nproperty short z\n\
                  element face 1\nproperty list uint8 int32 vertex_index\nend_header\n";
    let mut bytes = header.as_bytes().to_vec();
    for (x, y) in [(0.0f32, 0.0f64), (1.0, 0.0), (0.0, 1.0)] {
        bytes.extend(x.to_be_bytes());
        bytes.extend(y.to_be_bytes());
        bytes.extend(0i16.to_be_bytes());
    }
    bytes.push(3);
    bytes.extend([0i32, 1, 2].iter().flat_map(|v| v.to_be_bytes()));
    bytes
}

fn meshes(extension: &str, folder: &Path) -> Target {
    let seeds = seeds_of(extension, folder);
    let (path, out) = (folder.join(format!("a.{extension}")), folder.join("out"));
    Target::new(seeds, move |bytes| {
        let Ok(file) = decode_mesh(bytes, &path) else { return false };
        // What was read can be written, or is refused.
        if bytes.len().is_multiple_of(16) {
            for extension in ["ply", "obj", "glb", "off"] {
                let _ = write_mesh(&out.with_extension(extension), &file.mesh, &file.attributes);
            }
        }
        true
    })
}

fn materials(folder: &Path) -> Target {
    let (library, mesh) = (folder.join("a.mtl"), folder.join("a.obj"));
    let seed = "# two\nnewmtl a\nKa 1 1 1\nKd 0.5 0.5 0.5\nNs 10\nd 1\nTr 0\nillum 2\nmap_Kd -s 1 1 1 skin.png\nmap_Bump -bm 1 C:\\n.png\nnewmtl b\nKd 1 0 0\nmap_Kd b.jpg # no\n";
    let text = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 1/1 2/1 3/1\n";
    Target::new(vec![seed.into()], move |bytes| {
        std::fs::write(&library, bytes).unwrap();
        decode_mesh(text, &mesh).is_ok()
    })
}

/// Whatever geometry can be read goes through inspection and every stage up to the descriptors.
fn shapes(folder: &Path) -> Target {
    let path = folder.join("a.off");
    let tangled = joined(&[&grid(5, 5), &bumpy_sphere(1, 1), &bumpy_sphere(1, 1)]);
    let seeds = [bumpy_sphere(2, 1), bumpy_sphere(1, 2), grid(9, 7), tangled].into_iter().map(|mesh| {
        write_mesh(&path, &mesh, &Attributes::default()).unwrap();
        std::fs::read(&path).unwrap()
    });
    let mut options = ShapeOptions::default();
    (options.decimate, options.subdivide) = (Some(60), Some(50));
    let mut shot = ShotOptions::default();
    shot.radius = 0.3;
    let target = Target::new(seeds.collect(), move |bytes| {
        let Ok(file) = decode_mesh(bytes, Path::new("a.off")) else { return false };
        inspect(&file.mesh);
        let context = Context::SILENT;
        Shape::new("fuzz", &file.mesh, &options, context)
            .and_then(|shape| Ok((shape.gradients(6, context)?, shape.shot(&shot, context)?)))
            .is_ok()
    });
    // Products pack their panels in buffers of the size of the last-level cache, some hundred MiB on large machines.
    target.with_memory(1 << 30)
}

fn maps(name: &str, folder: &Path) -> Target {
    let path = folder.join(name);
    let (targets, confidence) = (vec![1, 0, PointMap::UNMATCHED], Some(vec![0.5, 1.0, 0.0]));
    let points = Some(vec![Some(SurfacePoint { face: 3, weights: [0.25, 0.5, 0.25] }), None, None]);
    write_point_map(&path, &PointMap { confidence, points, ..PointMap::new(targets, 2) }).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let wide: Vec<u8> = [&[0xFF, 0xFE][..], &bytes.iter().flat_map(|&b| [b, 0]).collect::<Vec<_>>()].concat();
    let seeds = if name == "map.npy" { vec![bytes] } else { vec![bytes, wide] };
    Target::new(seeds, move |bytes| {
        std::fs::write(&path, bytes).unwrap();
        read_point_map(&path, None).is_ok() | read_point_map(&path, Some(2)).is_ok()
    })
}

fn landmarks(folder: &Path) -> Target {
    let path = folder.join("landmarks.txt");
    let seeds = vec![b"# nose\n3 7\n\n5\n 1e1 2\n".to_vec(), b"\xFF\xFE1\x00\n\x00".to_vec()];
    Target::new(seeds, move |bytes| {
        std::fs::write(&path, bytes).unwrap();
        read_landmarks(&path).is_ok()
    })
}

fn described() -> Target {
    let options = MatchOptions::default()
        .descriptor(DescriptorKind::Shot)
        .k(5)
        .shot_radius(0.3)
        .subdivide(Resize::Never);
    let matcher = Matcher::new(&options).unwrap();
    let shape = matcher.describe("fuzz", &bumpy_sphere(1, 1), &ignore).unwrap();
    Target::new(vec![shape.encode()], |bytes| DescribedShape::decode(bytes, Path::new("a.fms")).is_ok())
}

fn matrices(folder: &Path) -> Target {
    let path = folder.join("matrix.npy");
    write_matrix(&path, &Matrix::from_vec(2, 2, vec![0.0, 1.0, 2.0, 3.0])).unwrap();
    let doubles = std::fs::read(&path).unwrap();
    write_matrix(&path, &Matrix::from_vec(1, 4, vec![0.0f32; 4])).unwrap();
    let singles = std::fs::read(&path).unwrap();
    let labels = NpyArray::Integers(Matrix::from_vec(2, 2, vec![0, 1, 200, 255]), NpyKind::U1);
    write_npy(&path, &labels).unwrap();
    Target::new(vec![doubles, singles, std::fs::read(&path).unwrap()], move |bytes| {
        std::fs::write(&path, bytes).unwrap();
        if let Ok(array) = read_npy(&path) {
            write_npy(&path.with_extension("out"), &array).unwrap();
        }
        let matrix = read_matrix::<f64>(&path).is_ok() | read_matrix::<f32>(&path).is_ok();
        matrix | read_vector::<f64>(&path).is_ok() | read_vector::<i32>(&path).is_ok()
    })
}

fn small_residual() -> ResidualOptions {
    ResidualOptions { blocks: 1, ..ResidualOptions::default() }
}

fn small_diffusion() -> DiffusionOptions {
    DiffusionOptions {
        blocks: 1,
        width: 4,
        outputs: 3,
        eigenfunctions: 3,
        wks_energies: 4,
        wks_eigenfunctions: 5,
        ..DiffusionOptions::default()
    }
}

/// Loads and, where the file is accepted, runs it.
fn models() -> Target {
    let network = ResidualNetwork::new(small_residual(), 1, &Device::Cpu).unwrap();
    let diffusion = DiffusionNetwork::new(small_diffusion(), 1, &Device::Cpu).unwrap();
    let mut seeds: Vec<Vec<u8>> =
        [true, false].map(|per_shape| to_onnx(&network, &test_metadata(per_shape)).unwrap()).into();
    seeds.push(to_onnx(&diffusion, &test_metadata(false)).unwrap());
    let target = Target::new(seeds, move |bytes| {
        let loads = |backend| DescriptorNetwork::from_bytes(Path::new("model.onnx"), bytes, backend);
        [Backend::Native, Backend::Tract].into_iter().all(|b| loads(b).is_ok_and(|network| runs(&network)))
    });
    target.with_memory(256 << 20)
}

/// Whether the network accepts arrays of the sizes that it asks for.
fn runs(network: &DescriptorNetwork) -> bool {
    let n = 3;
    let array = |input: &ModelInput| {
        let len: usize = input.quantity.dims(input.width).iter().map(|dim| dim.unwrap_or(n)).product();
        (0..len).map(|i| (i as f32 * 0.1).sin().abs()).collect::<Vec<f32>>()
    };
    let arrays: Vec<Vec<f32>> = network.contract().inputs.iter().map(array).collect();
    network.descriptors(n, &arrays.iter().map(Vec::as_slice).collect::<Vec<_>>()).is_ok()
}

fn manifests(folder: &Path) -> Target {
    let (mesh, path, folder) = (folder.join("a.off"), folder.join("dataset.toml"), folder.to_path_buf());
    write_mesh(&mesh, &grid(2, 2), &Attributes::default()).unwrap();
    std::fs::write(folder.join("a.vts"), "1\n0\n3\n").unwrap();
    let seed = "format = 1\n[[shape]]\nname = \"a\"\nmesh = \"a.off\"\ngroup = \"g\"\ncorrespondence = \"a.vts\"\nsplit = \"train\"\n\
                partial = false\n[[shape]]\nname = \"b\"\nmesh = \"a.off\"\ngroup = \"g\"\nsplit = \"test\"\n";
    Target::new(vec![seed.into()], move |bytes| {
        std::fs::write(&path, bytes).unwrap();
        let Ok(dataset) = Dataset::open(&folder) else { return false };
        let read = |shape: &ShapeEntry| shape.read().and_then(|mesh| shape.points(&mesh)).is_ok();
        dataset.shapes.iter().all(read)
    })
}

fn surface_points(folder: &Path) -> Target {
    let path = folder.join("part.corr");
    let points = [Some(SurfacePoint { face: 2, weights: [0.25, 0.5, 0.25] }), None];
    write_surface_points(&path, &points).unwrap();
    Target::new(vec![std::fs::read(&path).unwrap()], move |bytes| {
        std::fs::write(&path, bytes).unwrap();
        read_surface_points(&path, 8).is_ok()
    })
}

fn barycentric(folder: &Path) -> Target {
    let (whole, path) = (folder.join("whole.off"), folder.join("part.baryc_gt"));
    write_mesh(&whole, &grid(2, 2), &Attributes::default()).unwrap();
    let entry = ShapeEntry {
        name: "part".into(),
        mesh: whole.clone(),
        group: "g".into(),
        correspondence: Correspondence::Barycentric(path.clone(), whole),
        split: Split::Train,
        whole: Some(PathBuf::from("whole.off")),
    };
    Target::new(
        vec![("1 1 0 0\n".repeat(grid(2, 2).n_vertices() - 2) + "2 0.25 0.5 0.25\n8 0 0 1\n").into()],
        move |bytes| {
            std::fs::write(&path, bytes).unwrap();
            entry.points(&grid(2, 2)).is_ok()
        },
    )
}

fn configs(folder: &Path) -> Target {
    let path: PathBuf = folder.join("config.toml");
    let earlier = "k = 70\nloss = \"siamese\"\nblocks = 2\n";
    Target::new(
        vec![TrainConfig::default().to_toml().into(), TrainConfig::paper().to_toml().into(), earlier.into()],
        move |bytes| {
            std::fs::write(&path, bytes).unwrap();
            TrainConfig::read(&path).is_ok_and(|config| config.check().is_ok() || config.dataset.0.is_empty())
        },
    )
}

fn checkpoints(folder: &Path) -> Target {
    let path = folder.join("last.safetensors");
    let network = ResidualNetwork::new(small_residual(), 1, &Device::Cpu).unwrap();
    let parameters = parameter_values(&network).unwrap();
    let checkpoint = Checkpoint {
        config: TrainConfig { network: NetworkOptions::Residual(small_residual()), ..TrainConfig::paper() },
        step: 3,
        best_error: f64::INFINITY,
        adam: AdamState { step: 3, first: vec![0.0; parameters.len()], second: vec![0.0; parameters.len()] },
        parameters,
        running: network.statistics(),
    };
    checkpoint.write(&path).unwrap();
    let target = Target::new(vec![std::fs::read(&path).unwrap()], move |bytes| {
        std::fs::write(&path, bytes).unwrap();
        Checkpoint::read(&path).is_ok_and(|checkpoint| checkpoint.network(&Device::Cpu).is_ok())
    });
    target.with_memory(64 << 20)
}

/// Entries whose checksum is right and whose content is not.
fn cache_entries(folder: &Path) -> Target {
    let cache = Cache::open(folder).unwrap();
    let mesh = bumpy_sphere(1, 1);
    let describe = |cache: &Cache| {
        let context = Context { cache: Some(cache), observer: &ignore };
        let shape = Shape::new("fuzz", &mesh, &ShapeOptions::default(), context)?;
        shape.unit_basis(4, context)?;
        Ok::<_, fmnet::Error>(shape.key())
    };
    let key = describe(&cache).unwrap();
    let Lookup::Hit(payload) = cache.get("mesh", key) else { panic!("the shape was not kept") };
    let mesh = mesh.clone();
    let target = Target::new(vec![payload], move |bytes| {
        cache.put("mesh", key, bytes).unwrap();
        let context = Context { cache: Some(&cache), observer: &ignore };
        let shape = Shape::new("fuzz", &mesh, &ShapeOptions::default(), context);
        shape.is_ok_and(|shape| shape.unit_basis(4, context).is_ok())
    });
    target.with_memory(64 << 20)
}
