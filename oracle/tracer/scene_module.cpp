// Python's door to scenes and rendering. oracle/tracer/scene.py describes a scene; here it is built piece by piece.
#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <map>

#include "arguments.h"
#include "bindings.h"
#include "render.h"

namespace oracle {
namespace {

using Numbers = std::array<double, 3>;

float number(double value, const char* name) {
    if (std::isfinite(value) && std::fabs(value) <= largest_coordinate) return static_cast<float>(value);
    std::ostringstream message;
    message << name << " is " << value << ", which is not a number within " << largest_coordinate;
    reject(message);
}

float positive(double value, const char* name) {
    const float result = number(value, name);
    if (result > 0) return result;
    std::ostringstream message;
    message << name << " is " << value << "; in single precision it must be above 0";
    reject(message);
}

Vec3 vector(const Numbers& v, const char* name) { return {number(v[0], name), number(v[1], name), number(v[2], name)}; }

Vec3 unit(const Numbers& v, const char* name) {
    const Vec3 d = vector(v, name);
    if (length_squared(d) > 0) return normalize(d);
    std::ostringstream message;
    message << name << " has no length in single precision";
    reject(message);
}

template <typename T>
T named(const std::string& name, const std::map<std::string, T>& names, const char* what) {
    if (const auto found = names.find(name); found != names.end()) return found->second;
    std::ostringstream message;
    message << what << " is '" << name << "'; it must be one of";
    for (const auto& [known, value] : names) message << " '" << known << "'";
    reject(message);
}

std::vector<Color> colors(const Doubles& array, const char* name) {
    std::vector<Color> result(size_t(array.size()) / 3);
    for (size_t i = 0; i < result.size(); ++i) {
        const double* c = array.data() + 3 * i;
        result[i] = {number(c[0], name), number(c[1], name), number(c[2], name)};
    }
    return result;
}

Doubles image(const py::object& input, const char* name) {
    const auto array = to_array<Doubles>(input, name, "fiu", "real numbers");
    if (array.ndim() == 3 && array.shape(2) == 3 && array.size() > 0) return array;
    std::ostringstream message;
    message << name << " has shape " << std::string(py::str(array.attr("shape"))) << "; expected (H, W, 3)";
    reject(message);
}

// Builds a scene and keeps it from being changed once it can be rendered.
class Stage {
public:
    int add_bitmap(const py::object& texels, bool smooth) {
        const Doubles array = image(texels, "texels");
        Texture t;
        t.kind = Texture::Kind::bitmap;
        t.height = int(array.shape(0)), t.width = int(array.shape(1)), t.smooth = smooth;
        t.texels = colors(array, "texels");
        return open().add_texture(std::move(t));
    }

    int add_checker(const Numbers& even, const Numbers& odd, double columns, double rows) {
        Texture t;
        t.kind = Texture::Kind::checker;
        t.even = vector(even, "even"), t.odd = vector(odd, "odd");
        t.columns = positive(columns, "columns"), t.rows = positive(rows, "rows");
        if (std::max(columns, rows) > 1e6) throw py::value_error("a checker has at most 1e6 columns and rows");
        return open().add_texture(std::move(t));
    }

    int add_material(const std::string& kind, const py::object& reflectance, const Numbers& eta, const Numbers& k, double ior,
                     double alpha, bool separable, double exponent, double weight, int first, int second) {
        using Kind = Material::Kind;
        static const std::map<std::string, Kind> kinds = {
            {"diffuse", Kind::diffuse},
            {"mirror", Kind::mirror},
            {"dielectric", Kind::dielectric},
            {"conductor", Kind::conductor},
            {"rough_conductor", Kind::rough_conductor},
            {"rough_dielectric", Kind::rough_dielectric},
            {"phong", Kind::phong},
            {"plastic", Kind::plastic},
            {"two_sided", Kind::two_sided},
            {"mix", Kind::mix},
        };
        Material m;
        m.kind = named(kind, kinds, "material");
        m.reflectance = color_map(reflectance, "reflectance");
        m.eta = vector(eta, "eta"), m.k = vector(k, "k");
        m.ior = positive(ior, "eta"), m.alpha = positive(alpha, "alpha"), m.separable = separable;
        m.exponent = number(exponent, "exponent"), m.weight = number(weight, "weight");
        m.first = first, m.second = second;
        if (m.kind == Kind::two_sided || m.kind == Kind::mix) {
            existing(first, scene_.materials.size(), "material");
            existing(second, scene_.materials.size(), "material");
        }
        return open().add_material(m);
    }

    int add_object(int material, const std::optional<py::object>& radiance, bool two_sided) {
        Object o;
        if (material >= 0) existing(material, scene_.materials.size(), "material");
        o.material = material;
        if (radiance) o.radiance = color_map(*radiance, "radiance");
        o.emits = radiance.has_value(), o.two_sided = two_sided;
        return open().add_object(o);
    }

    void add_mesh(int object, const py::object& vertices, const py::object& triangles, const py::object& normals,
                  const py::object& uv) {
        existing(object, scene_.objects.size(), "object");
        open().add_mesh(object, mesh(vertices, triangles, normals, uv));
    }

    void add_instances(int object, const py::object& vertices, const py::object& triangles, const py::object& normals,
                       const py::object& uv, const py::object& transforms) {
        existing(object, scene_.objects.size(), "object");
        const auto matrices = to_array<Doubles>(transforms, "transforms", "fiu", "real numbers");
        if (matrices.ndim() != 3 || matrices.shape(1) != 3 || matrices.shape(2) != 4)
            throw py::value_error("transforms must have the shape (N, 3, 4)");
        std::vector<Affine> maps(size_t(matrices.shape(0)));
        for (size_t i = 0; i < maps.size(); ++i)
            for (size_t j = 0; j < 12; ++j) maps[i][j] = number(matrices.data()[12 * i + j], "transforms");
        open().add_instances(object, mesh(vertices, triangles, normals, uv), maps);
    }

    void add_rectangle(int object, const Numbers& center, const Numbers& half_u, const Numbers& half_v) {
        existing(object, scene_.objects.size(), "object");
        const Vec3 c = vector(center, "center"), u = vector(half_u, "half_u"), v = vector(half_v, "half_v");
        if (!(length_squared(cross(u, v)) > 0)) throw py::value_error("the rectangle has no area in single precision");
        open().add_rectangle(object, c - u - v, 2 * u, 2 * v);
    }

    void add_disk(int object, const Numbers& center, const Numbers& normal, double radius) {
        existing(object, scene_.objects.size(), "object");
        open().add_disk(object, vector(center, "center"), unit(normal, "normal"), positive(radius, "radius"));
    }

    void add_sphere(int object, const Numbers& center, double radius) {
        existing(object, scene_.objects.size(), "object");
        open().add_sphere(object, vector(center, "center"), positive(radius, "radius"));
    }

    void add_point(const Numbers& position, const Numbers& intensity) {
        Light l{};
        l.kind = Light::Kind::point;
        l.p = l.center = vector(position, "position"), l.light = vector(intensity, "intensity");
        open().add_light(l);
    }

    void add_spot(const Numbers& position, const Numbers& direction, const Numbers& intensity, double full, double cutoff) {
        Light l{};
        l.kind = Light::Kind::spot;
        l.p = l.center = vector(position, "position"), l.n = unit(direction, "direction"), l.light = vector(intensity, "intensity");
        l.full = number(full, "beam_width"), l.cutoff = number(cutoff, "cutoff_angle");
        if (!(l.cutoff > l.full)) throw py::value_error("cutoff_angle must exceed beam_width in single precision");
        open().add_light(l);
    }

    void add_directional(const Numbers& direction, const Numbers& irradiance) {
        Light l{};
        l.kind = Light::Kind::directional;
        l.n = unit(direction, "direction"), l.light = vector(irradiance, "irradiance");
        open().add_light(l);
    }

    void set_constant(const Numbers& radiance) {
        Environment e;
        e.kind = Environment::Kind::constant;
        e.horizon = vector(radiance, "radiance");
        open().set_environment(std::move(e));
    }

    void set_sky(const Numbers& up, const Numbers& horizon, const Numbers& zenith) {
        Environment e;
        e.kind = Environment::Kind::sky;
        e.up = unit(up, "up"), e.horizon = vector(horizon, "horizon"), e.zenith = vector(zenith, "zenith");
        open().set_environment(std::move(e));
    }

    void set_map(const py::object& radiance, const Numbers& up, const Numbers& front) {
        const Doubles array = image(radiance, "radiance");
        Environment e;
        e.kind = Environment::Kind::map;
        e.up = unit(up, "up"), e.front = unit(front, "front"), e.left = cross(e.up, e.front);
        e.height = int(array.shape(0)), e.width = int(array.shape(1));
        e.texels = colors(array, "radiance");
        open().set_environment(std::move(e));
    }

    void set_medium(const Numbers& absorption, const Numbers& scattering, double asymmetry) {
        open().set_medium(vector(absorption, "absorption"), vector(scattering, "scattering"), number(asymmetry, "asymmetry"));
    }

    void commit(bool hierarchy) {
        Scene& scene = open();
        const py::gil_scoped_release release;
        scene.commit(hierarchy);
        committed_ = true;
    }

    void render_pass(const Sensor& sensor, const Film& film, const Pass& pass, int threads, py::array_t<uint64_t>& sums,
                     py::array_t<uint64_t>& squares, const py::function& watch) const {
        demand_committed();
        // (height, width, replicates, 3, 2) and (height, width, 3, 2), in place.
        const py::ssize_t pixels = py::ssize_t(film.width) * film.height;
        if (sums.size() != pixels * pass.replicates * 6 || squares.size() != pixels * 6 || threads < 0 || pass.samples < 1)
            throw py::value_error("sums, squares, threads or samples do not fit the film");
        auto* sum = reinterpret_cast<Sum*>(sums.mutable_data());
        auto* square = reinterpret_cast<Sum*>(squares.mutable_data());
        bool interrupted = false;
        const auto look = [&](double part) {
            const py::gil_scoped_acquire acquire;
            if (PyErr_CheckSignals() != 0) return !(interrupted = true);
            watch(part);
            return true;
        };
        Defect defect;
        {
            const py::gil_scoped_release release;
            defect = oracle::render_pass(scene_, sensor, film, pass, threads, sum, square, look);
        }
        if (interrupted) throw py::error_already_set();
        if (defect.kind == Defect::Kind::none) return;
        std::ostringstream message;
        message << "sample " << defect.sample << " of pixel (" << defect.x << ", " << defect.y << ") is "
                << (defect.kind == Defect::Kind::negative     ? "negative"
                    : defect.kind == Defect::Kind::not_finite ? "not finite"
                                                              : "too large");
        throw std::runtime_error(message.str());
    }

    py::tuple first_hits(const Sensor& sensor, const Film& film) const {
        demand_committed();
        std::vector<FirstHit> hits;
        {
            const py::gil_scoped_release release;
            hits = oracle::first_hits(scene_, sensor, film);
        }
        const py::ssize_t h = film.height, w = film.width;
        py::array_t<float> distance({h, w}), position({h, w, py::ssize_t{3}}), normal({h, w, py::ssize_t{3}}),
            albedo({h, w, py::ssize_t{3}});
        py::array_t<int64_t> object({h, w});
        for (size_t i = 0; i < hits.size(); ++i) {
            distance.mutable_data()[i] = hits[i].distance;
            object.mutable_data()[i] = hits[i].object;
            reinterpret_cast<Vec3*>(position.mutable_data())[i] = hits[i].position;
            reinterpret_cast<Vec3*>(normal.mutable_data())[i] = hits[i].normal;
            reinterpret_cast<Vec3*>(albedo.mutable_data())[i] = hits[i].albedo;
        }
        return py::make_tuple(distance, position, normal, albedo, object);
    }

private:
    Scene& open() {
        if (committed_) throw std::logic_error("the scene is committed");
        return scene_;
    }

    void demand_committed() const {
        if (!committed_) throw std::logic_error("the scene is not committed");
    }

    static void existing(int index, size_t count, const char* what) {
        if (index >= 0 && size_t(index) < count) return;
        throw py::index_error("there is no " + std::string(what) + " " + std::to_string(index));
    }

    // The number of a texture, or three numbers.
    ColorMap color_map(const py::object& value, const char* name) const {
        if (!py::isinstance<py::int_>(value)) return {vector(value.cast<Numbers>(), name), -1};
        const int index = value.cast<int>();
        existing(index, scene_.textures.size(), "texture");
        return {{}, index};
    }

    static Mesh mesh(const py::object& vertices, const py::object& triangles, const py::object& normals, const py::object& uv) {
        Mesh result = make_mesh(vertices, triangles);
        if (!normals.is_none()) {
            const auto array = to_array<Doubles>(normals, "normals", "fiu", "real numbers");
            if (rows_of_three(array, "normals", 'N') != result.vertices.size())
                throw py::value_error("normals must be as many as vertices");
            for (size_t i = 0; i < result.vertices.size(); ++i)
                result.normals.push_back(checked_point(array.data() + 3 * i, "normal", i));
        }
        if (!uv.is_none()) {
            const auto array = to_array<Doubles>(uv, "uv", "fiu", "real numbers");
            if (array.ndim() != 2 || array.shape(1) != 2 || size_t(array.shape(0)) != result.vertices.size())
                throw py::value_error("uv must have two columns and as many rows as there are vertices");
            for (size_t i = 0; i < result.vertices.size(); ++i) {
                const double *p = array.data() + 2 * i, largest_uv = 1e6;
                // Not beyond what fields of a checker can be counted in.
                if (!(std::fabs(p[0]) <= largest_uv && std::fabs(p[1]) <= largest_uv))
                    throw py::value_error("uv of vertex " + std::to_string(i) + " is not within 1e6");
                result.uv.push_back({float(p[0]), float(p[1])});
            }
        }
        return result;
    }

    Scene scene_;
    bool committed_ = false;
};

Sensor make_sensor(const std::string& kind, const Numbers& origin, const Numbers& forward, const Numbers& right,
                   const Numbers& down) {
    using Kind = Sensor::Kind;
    static const std::map<std::string, Kind> kinds = {
        {"perspective", Kind::perspective},
        {"orthographic", Kind::orthographic},
        {"irradiance_meter", Kind::irradiance_meter},
        {"radiance_meter", Kind::radiance_meter},
    };
    return {named(kind, kinds, "sensor"), vector(origin, "origin"), unit(forward, "forward"), vector(right, "right"),
            vector(down, "down")};
}

Pass make_pass(const std::string& strategy, int first_bounce, int bounces, const std::string& sampler, uint64_t seed,
               uint32_t first_sample, uint32_t samples, uint32_t replicates, int exponent) {
    static const std::map<std::string, Strategy> strategies = {{"light", Strategy::light},
                                                               {"bsdf", Strategy::bsdf},
                                                               {"hemisphere", Strategy::hemisphere},
                                                               {"mis", Strategy::mis}};
    static const std::map<std::string, SamplerKind> samplers = {{"independent", SamplerKind::independent},
                                                                {"sobol", SamplerKind::sobol}};
    if (replicates < 1) throw py::value_error("replicates must be at least 1");
    return {{named(strategy, strategies, "strategy"), first_bounce, bounces},
            named(sampler, samplers, "sampler"),
            seed,
            first_sample,
            samples,
            replicates,
            exponent};
}

}  // namespace

void bind_scene(py::module_& module) {
    const auto none = py::none();
    py::class_<Sensor>(module, "Sensor")
        .def(py::init(&make_sensor), py::arg("kind"), py::arg("origin"), py::arg("forward"), py::arg("right"), py::arg("down"));
    py::class_<Film>(module, "Film")
        .def(py::init([](int width, int height, double gaussian) {
                 if (width < 1 || height < 1) throw py::value_error("a film has at least one pixel");
                 return Film{width, height, number(gaussian, "gaussian")};
             }),
             py::arg("width"), py::arg("height"), py::arg("gaussian"));
    py::class_<Pass>(module, "Pass")
        .def(py::init(&make_pass), py::arg("strategy"), py::arg("first_bounce"), py::arg("bounces"), py::arg("sampler"),
             py::arg("seed"), py::arg("first_sample"), py::arg("samples"), py::arg("replicates"), py::arg("exponent"));
    const Numbers zero{};
    py::class_<Stage>(module, "Stage")
        .def(py::init())
        .def("add_bitmap", &Stage::add_bitmap, py::arg("texels"), py::arg("smooth"))
        .def("add_checker", &Stage::add_checker, py::arg("even"), py::arg("odd"), py::arg("columns"), py::arg("rows"))
        .def("add_material", &Stage::add_material, py::arg("kind"), py::kw_only(),
             py::arg("reflectance") = std::vector<double>{0, 0, 0}, py::arg("eta") = zero, py::arg("k") = zero,
             py::arg("ior") = 1.0, py::arg("alpha") = 1.0, py::arg("separable") = false, py::arg("exponent") = 0.0,
             py::arg("weight") = 0.0, py::arg("first") = -1, py::arg("second") = -1)
        .def("add_object", &Stage::add_object, py::arg("material"), py::arg("radiance"), py::arg("two_sided"))
        .def("add_mesh", &Stage::add_mesh, py::arg("object"), py::arg("vertices"), py::arg("triangles"), py::arg("normals"),
             py::arg("uv"))
        .def("add_instances", &Stage::add_instances, py::arg("object"), py::arg("vertices"), py::arg("triangles"),
             py::arg("normals"), py::arg("uv"), py::arg("transforms"))
        .def("add_rectangle", &Stage::add_rectangle, py::arg("object"), py::arg("center"), py::arg("half_u"),
             py::arg("half_v"))
        .def("add_disk", &Stage::add_disk, py::arg("object"), py::arg("center"), py::arg("normal"), py::arg("radius"))
        .def("add_sphere", &Stage::add_sphere, py::arg("object"), py::arg("center"), py::arg("radius"))
        .def("add_point", &Stage::add_point, py::arg("position"), py::arg("intensity"))
        .def("add_spot", &Stage::add_spot, py::arg("position"), py::arg("direction"), py::arg("intensity"),
             py::arg("beam_width"), py::arg("cutoff_angle"))
        .def("add_directional", &Stage::add_directional, py::arg("direction"), py::arg("irradiance"))
        .def("set_constant", &Stage::set_constant, py::arg("radiance"))
        .def("set_sky", &Stage::set_sky, py::arg("up"), py::arg("horizon"), py::arg("zenith"))
        .def("set_map", &Stage::set_map, py::arg("radiance"), py::arg("up"), py::arg("front"))
        .def("set_medium", &Stage::set_medium, py::arg("absorption"), py::arg("scattering"), py::arg("asymmetry"))
        .def("commit", &Stage::commit, py::arg("hierarchy") = false)
        .def("render_pass", &Stage::render_pass, py::arg("sensor"), py::arg("film"), py::arg("render_pass"),
             py::arg("threads"), py::arg("sums").noconvert(), py::arg("squares").noconvert(), py::arg("watch"))
        .def("first_hits", &Stage::first_hits, py::arg("sensor"), py::arg("film"));
}

}  // namespace oracle
