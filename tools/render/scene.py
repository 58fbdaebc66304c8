# SPDX-License-Identifier: Apache-2.0
"""The scene in Mitsuba 3 (PyPI `mitsuba`): an object of plastic or metal under an environment light, on a table or not.

Mitsuba's polarized variant needs LLVM 19 or later (Debian's libllvm19; 14 to 16 fail), found by itself or named by
DRJIT_LIBLLVM_PATH. Frames: Mitsuba's camera has x left, y up, z forward; its `stokes` integrator counts angles anticlockwise
as displayed, from the picture's x axis on the optical axis: see stokes.to_lens_frame for the other rays.
"""
import ctypes.util
import os

import numpy as np

from files.meshes import Mesh
from render.denoise import Features, denoise
from render.stokes import to_lens_frame
from render.surroundings import albedo, environment, table_print

if 'DRJIT_LIBLLVM_PATH' not in os.environ:
    for name in ('LLVM-22', 'LLVM-21', 'LLVM-20', 'LLVM-19'):
        if ctypes.util.find_library(name):
            os.environ['DRJIT_LIBLLVM_PATH'] = ctypes.util.find_library(name)

import drjit  # noqa: E402, which reads DRJIT_LIBLLVM_PATH
import mitsuba as mi  # noqa: E402

mi.set_variant('llvm_ad_mono_polarized')

TABLE_HALF = 2.3   # of the table's side, in object radii
TABLE_LIFT = 0.003  # the table above the object's lowest vertex, so that it stands in it
FEATURE_SAMPLES = 16
INTENSITY, S1, S2 = 2, 5, 8  # channels of the stokes integrator's picture; the first two are luminance and coverage


def table_mesh(vertices):
    """The table as two triangles."""
    height = vertices[:, 1].min() + TABLE_LIFT
    corners = np.array([[x, height, z] for x, z in ((-1, -1), (-1, 1), (1, 1), (1, -1))]) * [TABLE_HALF, 1, TABLE_HALF]
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), np.tile([0, 1.0, 0], (4, 1)))


def object_shape(mesh, colour, properties):
    """A Mitsuba mesh whose vertices' albedo is the place in a ramp: `pplastic` takes no colours of vertices."""
    holder = mi.Properties()
    holder['look'] = mi.load_dict(properties)
    shape = mi.Mesh('object', len(mesh.vertices), len(mesh.triangles), has_vertex_normals=True, has_vertex_texcoords=True,
                    props=holder)
    values = mi.traverse(shape)
    flat = lambda a, kind: np.ascontiguousarray(a, kind).ravel()
    values['vertex_texcoords'] = flat(np.stack([colour, np.full_like(colour, 0.5)], 1), np.float32)
    values['vertex_positions'] = flat(mesh.vertices, np.float32)
    values['vertex_normals'] = flat(mesh.normals, np.float32)
    values['faces'] = flat(mesh.triangles, np.uint32)
    values.update()
    return shape


def picture(values, **more):
    return {'type': 'bitmap', 'raw': True, 'bitmap': mi.Bitmap(np.asarray(values, np.float32)[:, :, None]), **more}


def material(args, reflectance):
    """The object's BSDF: --material, --alpha (roughness), --ior (plastic), --eta and --kappa (metal)."""
    if args.material == 'metal':
        return {'type': 'roughconductor', 'alpha': args.alpha, 'eta': args.eta, 'k': args.kappa,
                'specular_reflectance': reflectance}
    return {'type': 'pplastic', 'alpha': args.alpha, 'int_ior': args.ior, 'diffuse_reflectance': reflectance}


def table_material(args, print_):
    if args.table == 'matte':
        return {'type': 'twosided', 'bsdf': {'type': 'diffuse', 'reflectance': print_}}
    return {'type': 'pplastic', 'alpha': 0.3, 'int_ior': args.ior, 'diffuse_reflectance': print_}


def sensor(args):
    return {'type': 'perspective', 'fov': args.fov, 'fov_axis': 'x',
            'sampler': {'type': 'multijitter', 'sample_count': args.spp},
            'film': {'type': 'hdrfilm', 'width': args.width, 'height': args.height, 'pixel_format': 'luminance_alpha',
                     'component_format': 'float32', 'rfilter': {'type': 'box'}}}


def scenes(args, mesh):
    """(the scene, the same for noise-free features: every surface shines with its albedo and nothing is reflected)."""
    for_albedo, for_light, for_print = (np.random.default_rng([args.seed, i]) for i in range(3))
    ramp = picture(np.tile((np.arange(256) + 0.5) / 256, (2, 1)), wrap_mode='clamp')
    colour = albedo(mesh.vertices, args.texture, for_albedo) * args.albedo / 0.45
    light = np.repeat(environment(args.light, for_light)[:, :, None], 3, 2)
    scene = {'type': 'scene', 'sensor': sensor(args), 'env': {'type': 'envmap', 'bitmap': mi.Bitmap(light)},
             'integrator': {'type': 'stokes', 'nested': {'type': 'path', 'max_depth': 6, 'hide_emitters': True}},
             'object': object_shape(mesh, colour, material(args, ramp))}
    shining = {'type': 'scene', 'sensor': sensor(args),
               'integrator': {'type': 'aov', 'aovs': 'n:sh_normal,p:position', 'nested': {'type': 'path', 'max_depth': 1}},
               'object': object_shape(mesh, colour, {'type': 'area', 'radiance': ramp})}
    if args.table != 'none':
        print_ = picture(table_print(for_print))
        place = mi.ScalarTransform4f().translate([0, float(mesh.vertices[:, 1].min()) + TABLE_LIFT, 0])
        top = {'type': 'rectangle', 'to_world': place.rotate([1, 0, 0], -90).scale(TABLE_HALF)}
        scene['table'] = {**top, 'bsdf': table_material(args, print_)}
        shining['table'] = {**top, 'emitter': {'type': 'area', 'radiance': print_}}
    return mi.load_dict(scene), mi.load_dict(shining)


def set_values(scene, **values):
    """Sets the parameters of the scene whose names begin and end as given, e.g. env_to_world for env...to_world."""
    parameters = mi.traverse(scene)
    for name, value in values.items():
        begin, end = name.split('_', 1)
        parameters[next(k for k in parameters.keys() if k.startswith(begin) and k.endswith(end))] = value
    parameters.update()


def place_camera(pair, view, turntable):
    """Moves the camera of both scenes to the view; with `turntable` the light turns with it."""
    pose = np.eye(4)
    pose[:3, :3] = view.rotation.T @ np.diag([-1, -1, 1])
    pose[:3, 3] = view.position()
    for scene in pair:
        set_values(scene, sensor_to_world=mi.Transform4f(pose))
    if turntable:
        azimuth = np.degrees(np.arctan2(*-view.rotation[2, [0, 2]]))
        set_values(pair[0], env_to_world=mi.Transform4f().rotate([0, 1, 0], float(azimuth)))


def halves(scene, args, index):
    """Two independent renderings (h, w, 3) of S0, S1, S2, each the mean of half of the passes."""
    total = [0, 0]
    for number in range(args.passes):
        made = np.array(mi.render(scene, spp=args.spp, seed=(args.seed * 1000 + index) * 100 + number), np.float64)
        total[number % 2] = total[number % 2] + made[:, :, [INTENSITY, S1, S2]] / (args.passes / 2)
    return total


def features_of(shining, index):
    """Features for the regression, and the share of each pixel that something fills."""
    made = np.array(mi.render(shining, spp=FEATURE_SAMPLES, seed=index), np.float64)
    light, cover, normal, position = made[:, :, 0], made[:, :, 1], made[:, :, 2:5], made[:, :, 5:8]
    whole = (cover >= 0.999) & ((normal ** 2).sum(2) > 0.95)  # pixels that mix two surfaces stay as rendered
    return Features(normal, position, light, whole), cover


def render_view(pair, args, view, index):
    """Stokes image (3, h, w) in radiance and the lens's frame; its noise, before and after denoising; coverage (h, w).

    The noise is half the difference of two independent halves: as large as that of the mean, in root mean square.
    --clean: which of S0, S1, S2 are denoised (all, only S0, none).
    """
    place_camera(pair, view, args.turntable)
    features, cover = features_of(pair[1], index)
    one, two = halves(pair[0], args, index)
    noise = np.moveaxis(one - two, 2, 0) / 2
    stokes = to_lens_frame(np.moveaxis(one + two, 2, 0) / 2, view.rays(view.pixel_grid()))
    both = np.ascontiguousarray(np.moveaxis(np.concatenate([stokes, noise]), 0, 2))
    cleaned = {'all': [0, 1, 2, 3, 4, 5], 's0': [0, 3], 'none': []}[args.clean]
    if cleaned:
        pixel = view.translation[2] / view.focal[0]
        both[:, :, cleaned] = denoise(both[:, :, cleaned], features, args.radius, pixel)
    both = np.moveaxis(both, 2, 0)
    return both[:3], both[3:], noise, cover


def set_threads(count):
    drjit.set_thread_count(count)


def renderer():
    return f'mitsuba {mi.__version__} {mi.variant()}'
