// student.cpp: a renderer for direct light, in one file and without libraries.
//
// It reads a scene in JSON and writes the radiance that reaches the film as a PFM image. Surfaces are diffuse, light
// comes straight from the emitters, and every sample of a pixel asks each emitter once. Lengths are metres, colours are
// linear RGB. So that graders can be tried out, --bug switches on one of the mistakes that renderers often have.

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <iostream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

constexpr double pi = 3.14159265358979323846;
constexpr double infinity = std::numeric_limits<double>::infinity();

// ------------------------------------------------------------------------------------------------------ the bugs

// The default is none of them. Each is one line or two, at the place where the mistake is usually made.
enum class Bug {
    none, no_inverse_pi, extra_pi, no_receiver_cosine, no_light_cosine, inverse_distance, inverse_cube, no_light_area,
    hemisphere_pdf, no_visibility, two_sided_light, srgb_output, red_blue_swapped, flipped_vertically, half_pixel_shift,
    no_division, shadow_acne, mirrored_horizontally, wrong_fov_axis, clamped_output, no_spot_falloff, disk_no_sqrt,
    equal_triangle_odds, endless_shadow_rays, two_sided_surface, first_emitter_only, fixed_seed, same_noise
};

struct BugName {
    Bug bug;
    const char* name;
    const char* meaning;
};

// The names for the command line, and what the renderer then does wrong.
constexpr BugName bug_names[] = {
    {Bug::no_inverse_pi, "no-inverse-pi", "The BRDF is rho instead of rho / pi."},
    {Bug::extra_pi, "extra-pi", "The BRDF is rho / pi^2: pi is divided out once too often."},
    {Bug::no_receiver_cosine, "no-receiver-cosine", "The cosine at the receiving surface is left out."},
    {Bug::no_light_cosine, "no-light-cosine", "The cosine at the area emitter is left out."},
    {Bug::inverse_distance, "inverse-distance", "Light falls off with 1 / r instead of 1 / r^2."},
    {Bug::inverse_cube, "inverse-cube", "Light falls off with 1 / r^3 instead of 1 / r^2."},
    {Bug::no_light_area, "no-light-area", "The estimate of an area emitter is not multiplied by its area."},
    {Bug::hemisphere_pdf, "hemisphere-pdf", "Uniform directions are weighted with pdf 1 / pi instead of 1 / (2 pi)."},
    {Bug::no_visibility, "no-visibility", "There are no shadow rays: everything sees every emitter."},
    {Bug::two_sided_light, "two-sided-light", "Area emitters shine from their back, too."},
    {Bug::srgb_output, "srgb-output", "The image is sRGB-encoded instead of linear."},
    {Bug::red_blue_swapped, "red-blue-swapped", "The image holds blue, green, red."},
    {Bug::flipped_vertically, "flipped-vertically", "The rows are written top-down: the image stands on its head."},
    {Bug::half_pixel_shift, "half-pixel-shift", "Samples lie in [0.5, 1.5) of a pixel, not in [0, 1), in x and y."},
    {Bug::no_division, "no-division", "The samples are summed but not divided by their number."},
    {Bug::shadow_acne, "shadow-acne", "Shadow rays start at a hit point of single precision, without an offset."},
    {Bug::mirrored_horizontally, "mirrored-horizontally", "Left and right are exchanged."},
    {Bug::wrong_fov_axis, "wrong-fov-axis", "The field of view is taken as the vertical one."},
    {Bug::clamped_output, "clamped-output", "Radiance above 1 is cut off at 1."},
    {Bug::no_spot_falloff, "no-spot-falloff", "A spot keeps its full intensity up to the cutoff angle."},
    {Bug::disk_no_sqrt, "disk-no-sqrt", "Samples crowd at the centre of a disk: the radius lacks the square root."},
    {Bug::equal_triangle_odds, "equal-triangle-odds", "A mesh emitter picks each triangle equally often."},
    {Bug::endless_shadow_rays, "endless-shadow-rays", "Shadow rays go on behind the emitter and find occluders there."},
    {Bug::two_sided_surface, "two-sided-surface", "Diffuse surfaces reflect from their back, too."},
    {Bug::first_emitter_only, "first-emitter-only", "Only the first emitter of the scene lights the surfaces."},
    {Bug::fixed_seed, "fixed-seed", "The seed is ignored: every run has the same noise."},
    {Bug::same_noise, "same-noise", "Every pixel uses the same random numbers."},
};

// ------------------------------------------------------------------------------------------- vectors and colours

struct Vec {
    double x = 0, y = 0, z = 0;
};

using Rgb = Vec;  // red, green and blue are x, y and z

Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec operator*(Vec a, double s) { return {a.x * s, a.y * s, a.z * s}; }
Rgb operator*(Rgb a, Rgb b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
double length(Vec a) { return std::sqrt(dot(a, a)); }
double largest(Vec a) { return std::max({std::abs(a.x), std::abs(a.y), std::abs(a.z)}); }
Vec normalized(Vec a) { return a * (1 / length(a)); }

// A unit vector perpendicular to the unit vector n, made with the coordinate axis that n is farthest from.
Vec perpendicular(Vec n) {
    const double x = std::abs(n.x), y = std::abs(n.y), z = std::abs(n.z);
    return normalized(cross(n, x <= y && x <= z ? Vec{1, 0, 0} : y <= z ? Vec{0, 1, 0} : Vec{0, 0, 1}));
}

// ------------------------------------------------------------------------------------------------ random numbers

// PCG32 (O'Neill 2014): 64 bits of state, and an odd increment that selects the sequence.
struct Rng {
    std::uint64_t state, increment;
};

// The next number, uniform in [0, 1).
double uniform(Rng& rng) {
    const std::uint64_t old = rng.state;
    rng.state = old * 6364136223846793005u + rng.increment;
    const std::uint32_t shifted = static_cast<std::uint32_t>(((old >> 18) ^ old) >> 27);
    const std::uint32_t rotation = static_cast<std::uint32_t>(old >> 59);
    return ((shifted >> rotation) | (shifted << ((32 - rotation) & 31))) * (1.0 / 4294967296.0);
}

// The finaliser of SplitMix64: every bit of the input changes about half the bits of the output.
std::uint64_t scramble(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

// Every pair of seed and pixel has a starting point of its own on a sequence of its own: the noise is independent.
Rng make_rng(std::uint64_t seed, std::uint64_t pixel) {
    const std::uint64_t state = scramble(scramble(seed) ^ pixel);
    return {state, scramble(state) | 1};
}

// ---------------------------------------------------------------------------------------------------------- JSON

// A value of any type. The members that its type does not need stay empty.
struct Json {
    enum class Type { null, boolean, number, string, array, object };
    Type type = Type::null;
    double number = 0;              // a boolean is 0 or 1
    std::string text;               // of a string
    std::vector<std::string> keys;  // of an object, in step with its items
    std::vector<Json> items;        // of an array or an object
    std::string path;               // where in the scene it is, for error messages
    mutable bool used = false;      // whether somebody asked for it
};

// A text and how much of it has been read.
struct Cursor {
    const std::string& text;
    std::size_t at = 0;
};

// The two ways to fail: the text is not JSON, or the JSON is not a scene.
[[noreturn]] void syntax_error(const Cursor& c, const std::string& problem) {
    const auto here = c.text.begin() + static_cast<std::ptrdiff_t>(c.at);
    const auto lines = std::count(c.text.begin(), here, '\n');
    throw std::runtime_error("line " + std::to_string(lines + 1) + ": expected " + problem +
                             (c.at == c.text.size() ? ", but the file ends" : ""));
}

[[noreturn]] void fail(const Json& json, const std::string& problem) {
    throw std::runtime_error(json.path + ": " + problem);
}

// Skips space and looks at the next character; it is '\0' at the end.
char next(Cursor& c) {
    c.at = std::min(c.text.find_first_not_of(" \t\r\n", c.at), c.text.size());
    return c.text[c.at];
}

// Takes the next character if it is the wanted one.
bool take(Cursor& c, char wanted) {
    if (next(c) != wanted) return false;
    ++c.at;
    return true;
}

// The strings of a scene are names; they need no escape sequences.
std::string parse_string(Cursor& c) {
    if (!take(c, '"')) syntax_error(c, "a string in double quotes");
    const std::size_t start = c.at;
    for (; c.text[c.at] != '"'; ++c.at) {
        if (static_cast<unsigned char>(c.text[c.at]) < ' ') syntax_error(c, "the closing quote of a string");
        if (c.text[c.at] == '\\') syntax_error(c, "a string without escape sequences");
    }
    return c.text.substr(start, c.at++ - start);
}

// The depth is limited because the recursion would otherwise use up the stack; a scene needs 6 levels.
Json parse_value(Cursor& c, const std::string& path, int depth) {
    if (depth > 50) syntax_error(c, "no more than 50 values inside each other");
    const char first = next(c);
    const std::size_t start = c.at;
    Json json;
    json.path = path;
    if (first == '{' || first == '[') {
        const char last = first == '{' ? '}' : ']';
        json.type = first == '{' ? Json::Type::object : Json::Type::array;
        ++c.at;
        if (take(c, last)) return json;
        do {
            std::string item_path = path + "[" + std::to_string(json.items.size()) + "]";
            if (first == '{') {
                const std::string key = parse_string(c);
                if (std::find(json.keys.begin(), json.keys.end(), key) != json.keys.end())
                    syntax_error(c, "every key once, not \"" + key + "\" twice");
                if (!take(c, ':')) syntax_error(c, "':' after the key");
                item_path = path + "." + key;
                json.keys.push_back(key);
            }
            json.items.push_back(parse_value(c, item_path, depth + 1));
        } while (take(c, ','));
        if (!take(c, last)) syntax_error(c, std::string("',' or '") + last + "'");
    } else if (first == '"') {
        json.type = Json::Type::string;
        json.text = parse_string(c);
    } else if (first == '-' || std::isdigit(static_cast<unsigned char>(first))) {
        json.type = Json::Type::number;
        c.at = std::min(c.text.find_first_not_of("+-.0123456789eE", start), c.text.size());
        const std::string digits = c.text.substr(start, c.at - start);
        char* end = nullptr;
        json.number = std::strtod(digits.c_str(), &end);
        if (*end != '\0') syntax_error(c, "a number, not " + digits);
    } else {
        const bool is_true = c.text.compare(start, 4, "true") == 0, is_null = c.text.compare(start, 4, "null") == 0;
        if (!is_true && !is_null && c.text.compare(start, 5, "false") != 0) syntax_error(c, "a JSON value");
        json.type = is_null ? Json::Type::null : Json::Type::boolean;
        json.number = is_true;
        c.at += is_true || is_null ? 4 : 5;
    }
    return json;
}

// The value of a key, or null if the object does not have it.
const Json* find(const Json& object, const std::string& key) {
    if (object.type != Json::Type::object) fail(object, "expected an object in {}");
    const auto found = std::find(object.keys.begin(), object.keys.end(), key);
    if (found == object.keys.end()) return nullptr;
    const Json& value = object.items[static_cast<std::size_t>(found - object.keys.begin())];
    value.used = true;
    return &value;
}

const Json& get(const Json& object, const std::string& key) {
    const Json* value = find(object, key);
    if (!value) fail(object, "\"" + key + "\" is missing");
    return *value;
}

// What follows turns JSON into the type that is wanted, or fails.
const std::string& read_text(const Json& json) {
    if (json.type != Json::Type::string) fail(json, "expected a string");
    return json.text;
}

const std::vector<Json>& read_array(const Json& json) {
    if (json.type != Json::Type::array) fail(json, "expected an array in []");
    return json.items;
}

// Within 1e30, products of several numbers stay finite. What a double cannot hold, such as 1e999, is refused, too.
double read_number(const Json& json, double low = -1e30, double high = 1e30) {
    if (json.type != Json::Type::number) fail(json, "expected a number");
    if (!(json.number >= low && json.number <= high)) fail(json, "the number is outside its range");
    return json.number;
}

std::size_t read_size(const Json& json, double low, double high) {
    const double number = read_number(json, low, high);
    if (number != std::floor(number)) fail(json, "expected a whole number");
    return static_cast<std::size_t>(number);
}

Vec read_vec(const Json& json, double low = -1e30, double high = 1e30) {
    const std::vector<Json>& items = read_array(json);
    if (items.size() != 3) fail(json, "expected three numbers");
    return {read_number(items[0], low, high), read_number(items[1], low, high), read_number(items[2], low, high)};
}

Vec read_direction(const Json& json) {
    const Vec v = read_vec(json);
    if (length(v) < 1e-12) fail(json, "this vector has no length");
    return v;
}

// A key that nobody asked for is a mistake, perhaps a misspelt one.
void refuse_unused(const Json& json) {
    for (std::size_t i = 0; i < json.items.size(); ++i) {
        if (i < json.keys.size() && !json.items[i].used) fail(json.items[i], "unknown key");
        refuse_unused(json.items[i]);
    }
}

// --------------------------------------------------------------------------------------------------------- scene

enum class ShapeKind { rectangle, disk, triangle, sphere };

// A piece of surface. The flat kinds are spanned by u and v: their points are origin + s u + t v, where (s, t) lies
// in the square [-1, 1]^2 (rectangle), in the unit circle (disk), or in the triangle s, t >= 0, s + t <= 1.
struct Shape {
    ShapeKind kind = ShapeKind::sphere;
    Vec origin, normal;
    Vec s_axis, t_axis;  // s and t of a point are the dot products of (point - origin) with these
    Vec u, v;
    double radius = 0, area = 0;
    double extent = 0;  // no coordinate that occurs on the shape is larger
    Rgb reflectance;    // of an object
    Rgb radiance;       // of an area emitter
};

// What lights the scene. A kind of emitter uses only the members that it needs.
enum class EmitterKind { area, point, spot, directional, constant };

struct Emitter {
    EmitterKind kind = EmitterKind::point;
    Rgb power;                            // radiance, intensity or irradiance, depending on the kind
    Vec position, direction;              // the direction is a unit vector, along which the light travels
    double cutoff_angle = 0, beam_width = 0;
    std::size_t first_shape = 0;          // of an area emitter; its shapes follow one another
    std::vector<double> cumulative_area;  // of its shapes
};

struct Camera {
    Vec origin, forward, right, up;
    double tan_x = 0, tan_y = 0;  // half the width and height of the film at distance 1
};

struct Scene {
    std::vector<Shape> shapes;
    std::vector<Emitter> emitters;
    Camera camera;
    std::size_t width = 0, height = 0;
};

// A shape that lies in a plane, with all that follows from its vectors u and v.
Shape make_flat(const Json& json, ShapeKind kind, Vec origin, Vec u, Vec v) {
    const Vec across = cross(u, v);
    const double parallelogram = length(across);
    if (!(parallelogram > 1e-100)) fail(json, "this shape has no area");
    Shape shape;
    shape.kind = kind;
    shape.origin = origin;
    shape.u = u;
    shape.v = v;
    shape.normal = across * (1 / parallelogram);
    shape.s_axis = cross(v, shape.normal) * (1 / parallelogram);
    shape.t_axis = cross(shape.normal, u) * (1 / parallelogram);
    shape.area = parallelogram * (kind == ShapeKind::rectangle ? 4 : kind == ShapeKind::disk ? pi : 0.5);
    shape.extent = largest(origin) + largest(u) + largest(v);
    return shape;
}

// A shape of the scene file; a mesh becomes many triangles.
std::vector<Shape> read_shapes(const Json& json) {
    const std::string& type = read_text(get(json, "type"));
    if (type == "rectangle") {
        const Vec u = read_direction(get(json, "half_u")), v = read_direction(get(json, "half_v"));
        if (std::abs(dot(u, v)) > 1e-9 * length(u) * length(v)) fail(json, "half_u and half_v are not orthogonal");
        return {make_flat(json, ShapeKind::rectangle, read_vec(get(json, "center")), u, v)};
    }
    if (type == "mesh") {
        std::vector<Vec> vertices;
        for (const Json& vertex : read_array(get(json, "vertices"))) vertices.push_back(read_vec(vertex));
        std::vector<Shape> shapes;
        for (const Json& triangle : read_array(get(json, "triangles"))) {
            std::vector<Vec> corners;
            for (const Json& index : read_array(triangle))
                corners.push_back(vertices[read_size(index, 0, static_cast<double>(vertices.size()) - 1)]);
            if (corners.size() != 3) fail(triangle, "expected three vertex numbers");
            const Vec u = corners[1] - corners[0], v = corners[2] - corners[0];
            shapes.push_back(make_flat(triangle, ShapeKind::triangle, corners[0], u, v));
        }
        if (shapes.empty()) fail(json, "this mesh has no triangles");
        return shapes;
    }
    if (type != "disk" && type != "sphere") fail(json, "unknown shape " + type);
    const Vec center = read_vec(get(json, "center"));
    const double radius = read_number(get(json, "radius"), 1e-30);
    if (type == "disk") {
        const Vec normal = normalized(read_direction(get(json, "normal"))), u = perpendicular(normal);
        return {make_flat(json, ShapeKind::disk, center, u * radius, cross(normal, u) * radius)};
    }
    Shape sphere;
    sphere.origin = center;
    sphere.radius = radius;
    sphere.area = 4 * pi * radius * radius;
    sphere.extent = largest(center) + radius;
    return {sphere};
}

// An object is a shape and a material; its shapes join those of the scene.
void add_object(Scene& scene, const Json& json) {
    const Json& material = get(json, "material");
    if (read_text(get(material, "type")) != "diffuse") fail(material, "unknown material");
    for (Shape& shape : read_shapes(get(json, "shape"))) {
        shape.reflectance = read_vec(get(material, "reflectance"), 0, 1);
        scene.shapes.push_back(shape);
    }
}

// An area emitter is a shape of the scene, too: it is seen and it casts shadows.
void add_emitter(Scene& scene, const Json& json) {
    const std::string& type = read_text(get(json, "type"));
    Emitter emitter;
    if (type == "area") {
        emitter.kind = EmitterKind::area;
        emitter.power = read_vec(get(json, "radiance"), 0);
        emitter.first_shape = scene.shapes.size();
        double area = 0;
        for (Shape& shape : read_shapes(get(json, "shape"))) {
            shape.radiance = emitter.power;
            scene.shapes.push_back(shape);
            emitter.cumulative_area.push_back(area += shape.area);
        }
    } else if (type == "point" || type == "spot") {
        emitter.kind = EmitterKind::point;
        emitter.power = read_vec(get(json, "intensity"), 0);
        emitter.position = read_vec(get(json, "position"));
        if (type == "spot") {
            emitter.kind = EmitterKind::spot;
            emitter.direction = normalized(read_direction(get(json, "direction")));
            emitter.cutoff_angle = read_number(get(json, "cutoff_angle"), 0, 90) * pi / 180;
            emitter.beam_width = read_number(get(json, "beam_width"), 0, 90) * pi / 180;
            if (emitter.beam_width >= emitter.cutoff_angle) fail(json, "beam_width is not below cutoff_angle");
        }
    } else if (type == "directional") {
        emitter.kind = EmitterKind::directional;
        emitter.power = read_vec(get(json, "irradiance"), 0);
        emitter.direction = normalized(read_direction(get(json, "direction")));
    } else if (type == "constant") {
        emitter.kind = EmitterKind::constant;
        emitter.power = read_vec(get(json, "radiance"), 0);
    } else {
        fail(json, "unknown emitter " + type);
    }
    scene.emitters.push_back(emitter);
}

// The film is as wide as the angle fov_x at distance 1, and its pixels are square.
Camera read_camera(const Json& json, double width, double height, Bug bug) {
    if (const Json* type = find(json, "type"); type && read_text(*type) != "perspective") fail(*type, "unknown camera");
    Camera camera;
    camera.origin = read_vec(get(json, "origin"));
    const Vec forward = read_vec(get(json, "target")) - camera.origin;
    const Json* given_up = find(json, "up");
    const Vec up = given_up ? read_direction(*given_up) : Vec{0, 0, 1};
    const Vec right = cross(forward, up);
    if (!(length(right) > 1e-9 * length(forward) * length(up))) fail(json, "origin, target and up lie on one line");
    camera.forward = normalized(forward);
    camera.right = normalized(right);
    camera.up = cross(camera.right, camera.forward);
    const double tangent = std::tan(read_number(get(json, "fov_x"), 1e-9, 180 - 1e-9) * pi / 360);
    camera.tan_x = bug == Bug::wrong_fov_axis ? tangent * width / height : tangent;
    camera.tan_y = camera.tan_x * height / width;
    return camera;
}

// The scene from the text of its file.
Scene read_scene(const std::string& text, Bug bug) {
    Cursor cursor{text};
    const Json json = parse_value(cursor, "scene", 0);
    next(cursor);
    if (cursor.at != text.size()) syntax_error(cursor, "nothing after the scene");
    if (const Json* format = find(json, "format"); format && read_text(*format) != "render-oracle-scene")
        fail(*format, "not a scene");
    if (const Json* version = find(json, "version")) read_size(*version, 1, 1);
    Scene scene;
    const Json& film = get(json, "film");
    scene.width = read_size(get(film, "width"), 1, 16384);
    scene.height = read_size(get(film, "height"), 1, 16384);
    if (const Json* filter = find(film, "filter"); filter && read_text(get(*filter, "type")) != "box")
        fail(*filter, "only the box filter can be rendered");
    scene.camera = read_camera(get(json, "camera"), static_cast<double>(scene.width),
                               static_cast<double>(scene.height), bug);
    if (const Json* objects = find(json, "objects"))
        for (const Json& object : read_array(*objects)) add_object(scene, object);
    if (const Json* emitters = find(json, "emitters"))
        for (const Json& emitter : read_array(*emitters)) add_emitter(scene, emitter);
    refuse_unused(json);
    return scene;
}

// -------------------------------------------------------------------------------------------------- intersection

struct Ray {
    Vec origin, direction;  // the direction is a unit vector
};

// The smallest distance > 0 along the ray at which it meets the shape, or infinity.
double intersect(const Shape& shape, const Ray& ray) {
    const Vec from_origin = ray.origin - shape.origin;
    if (shape.kind == ShapeKind::sphere) {
        // How far the ray's line passes from the centre comes from a difference of vectors, not of squared lengths:
        // that stays accurate for a small sphere far away.
        const double along = dot(from_origin, ray.direction);
        const Vec closest = from_origin - ray.direction * along;
        const double half_chord_squared = shape.radius * shape.radius - dot(closest, closest);
        if (half_chord_squared < 0) return infinity;
        const double half_chord = std::sqrt(half_chord_squared);
        const double entry = -along - half_chord, exit = -along + half_chord;
        return entry > 0 ? entry : exit > 0 ? exit : infinity;
    }
    // A ray parallel to the plane divides by 0 here; infinity and "not a number" then both count as no hit.
    const double distance = -dot(from_origin, shape.normal) / dot(ray.direction, shape.normal);
    if (!(distance > 0 && distance < infinity)) return infinity;
    const Vec q = from_origin + ray.direction * distance;
    const double s = dot(q, shape.s_axis), t = dot(q, shape.t_axis);
    const bool inside = shape.kind == ShapeKind::rectangle ? std::abs(s) <= 1 && std::abs(t) <= 1
                        : shape.kind == ShapeKind::disk    ? s * s + t * t <= 1
                                                           : s >= 0 && t >= 0 && s + t <= 1;
    return inside ? distance : infinity;
}

// Whether something is in the way along the first part of the ray.
bool is_blocked(const Scene& scene, const Ray& ray, double up_to) {
    for (const Shape& shape : scene.shapes)
        if (intersect(shape, ray) < up_to) return true;
    return false;
}

// A point on a surface. Shadow rays start from, or end at, a place slightly above it.
struct SurfacePoint {
    Vec position, normal, above;
};

// Rounding moves a computed point by about 1e-16 of the coordinates and distances that went into it. A hundred
// thousand times that is certainly enough, and still far below everything that is visible.
double safe_offset(const Shape& shape, double distance) { return 1e-11 * (shape.extent + distance); }

// The point where the ray hits the shape. Its normal is that of the front, even if the ray comes from the back.
SurfacePoint point_at(const Ray& ray, const Shape& shape, double distance, Bug bug) {
    SurfacePoint point{ray.origin + ray.direction * distance, shape.normal, {}};
    if (shape.kind == ShapeKind::sphere) {
        point.normal = normalized(point.position - shape.origin);
        point.position = shape.origin + point.normal * shape.radius;
    }
    point.above = point.position + point.normal * safe_offset(shape, distance);
    // Single precision puts about every second point below its own surface, where no light arrives.
    if (bug == Bug::shadow_acne) point.above = ray.origin + ray.direction * static_cast<float>(distance);
    return point;
}

// --------------------------------------------------------------------------------------------------- direct light

// A place that light comes from, and the irradiance it causes on a surface that faces it, if nothing is in between.
struct LightSample {
    Vec to_light;  // a unit vector
    Vec end;       // where shadow rays end, if the light is not infinitely far away
    bool is_infinite = true;
    Rgb irradiance;
};

// Irradiance from a point falls with the square of the distance.
double distance_falloff(double distance, Bug bug) {
    if (bug == Bug::inverse_distance) return 1 / distance;
    if (bug == Bug::inverse_cube) return 1 / (distance * distance * distance);
    return 1 / (distance * distance);
}

// A uniformly distributed point on the shape: its pdf is 1 / area.
SurfacePoint sample_shape(const Shape& shape, Rng& rng, Bug bug) {
    double s = uniform(rng), t = uniform(rng);
    const double phi = 2 * pi * t;
    if (shape.kind == ShapeKind::sphere) {
        const double z = 1 - 2 * s, r = std::sqrt(1 - z * z);
        const Vec normal{r * std::cos(phi), r * std::sin(phi), z};
        return {shape.origin + normal * shape.radius, normal, {}};
    }
    if (shape.kind == ShapeKind::rectangle) {
        s = 2 * s - 1;
        t = 2 * t - 1;
    } else if (shape.kind == ShapeKind::disk) {
        const double r = bug == Bug::disk_no_sqrt ? s : std::sqrt(s);
        s = r * std::cos(phi);
        t = r * std::sin(phi);
    } else if (s + t > 1) {
        s = 1 - s;  // the far half of the parallelogram folds back into the triangle
        t = 1 - t;
    }
    return {shape.origin + shape.u * s + shape.v * t, shape.normal, {}};
}

// Area emitters: a point is chosen uniformly on the surface.
LightSample sample_area(const Emitter& emitter, const Scene& scene, Vec receiver, Rng& rng, Bug bug) {
    // Choose one of the shapes, with a probability proportional to its area.
    const std::vector<double>& sums = emitter.cumulative_area;
    const double area = sums.back(), u = sums.size() > 1 ? uniform(rng) : 0;
    auto chosen = static_cast<std::size_t>(std::upper_bound(sums.begin(), sums.end(), u * area) - sums.begin());
    if (bug == Bug::equal_triangle_odds) chosen = static_cast<std::size_t>(u * static_cast<double>(sums.size()));
    const Shape& shape = scene.shapes[emitter.first_shape + std::min(chosen, sums.size() - 1)];

    // Light leaves from the front only. For the sake of the bug, the shadow ray ends on the receiver's side.
    const SurfacePoint light = sample_shape(shape, rng, bug);
    const Vec way = light.position - receiver;
    const double distance = length(way);
    const Vec to_light = way * (1 / distance);
    double cosine = -dot(light.normal, to_light);
    const double side = cosine > 0 ? 1 : -1;
    if (bug == Bug::two_sided_light) cosine = std::abs(cosine);
    if (cosine <= 0) return {};
    const Vec end = light.position + light.normal * (side * safe_offset(shape, distance));

    // Divide by the pdf per area; cos / r^2 is the solid angle that an area is seen under.
    if (bug == Bug::no_light_cosine) cosine = 1;
    const double pdf = bug == Bug::no_light_area ? 1 : 1 / area;
    return {to_light, end, false, emitter.power * (cosine * distance_falloff(distance, bug) / pdf)};
}

// Points and spots. The intensity of a spot falls linearly with the angle, from its beam width to its cutoff angle.
LightSample sample_point(const Emitter& emitter, Vec receiver, Bug bug) {
    const Vec way = emitter.position - receiver;
    const double distance = length(way);
    const Vec to_light = way * (1 / distance);
    double fade = 1;
    if (emitter.kind == EmitterKind::spot) {
        const double angle = std::acos(std::clamp(-dot(to_light, emitter.direction), -1.0, 1.0));
        fade = (emitter.cutoff_angle - angle) / (emitter.cutoff_angle - emitter.beam_width);
        if (bug == Bug::no_spot_falloff) fade = fade > 0 ? 1 : 0;
        fade = std::clamp(fade, 0.0, 1.0);
    }
    return {to_light, emitter.position, false, emitter.power * (fade * distance_falloff(distance, bug))};
}

// A constant environment: directions are uniform over the hemisphere, with the pdf 1 / (2 pi).
LightSample sample_constant(const Emitter& emitter, Vec normal, Rng& rng, Bug bug) {
    const double z = uniform(rng), r = std::sqrt(1 - z * z), phi = 2 * pi * uniform(rng);
    const Vec x_axis = perpendicular(normal), y_axis = cross(normal, x_axis);
    const Vec direction = x_axis * (r * std::cos(phi)) + y_axis * (r * std::sin(phi)) + normal * z;
    const double pdf = bug == Bug::hemisphere_pdf ? 1 / pi : 1 / (2 * pi);
    return {direction, {}, true, emitter.power * (1 / pdf)};
}

// Shadow ray: whether the light of a sample arrives.
bool is_visible(const Scene& scene, Vec from, const LightSample& light, Bug bug) {
    if (bug == Bug::no_visibility) return true;
    if (light.is_infinite) return !is_blocked(scene, {from, light.to_light}, infinity);
    const Vec way = light.end - from;
    const double distance = length(way);
    // Ending a little earlier keeps a point emitter visible that lies exactly on a surface, such as a ceiling.
    const double up_to = bug == Bug::endless_shadow_rays ? infinity : distance * (1 - 1e-11);
    return !is_blocked(scene, {from, way * (1 / distance)}, up_to);
}

// The irradiance from all emitters, estimated with one sample of each.
Rgb direct_irradiance(const Scene& scene, const SurfacePoint& point, Rng& rng, Bug bug) {
    Rgb sum;
    for (const Emitter& emitter : scene.emitters) {
        if (bug == Bug::first_emitter_only && &emitter != &scene.emitters.front()) break;
        LightSample light;
        switch (emitter.kind) {
            case EmitterKind::area: light = sample_area(emitter, scene, point.position, rng, bug); break;
            case EmitterKind::point:
            case EmitterKind::spot: light = sample_point(emitter, point.position, bug); break;
            case EmitterKind::directional: light = {emitter.direction * -1, {}, true, emitter.power}; break;
            case EmitterKind::constant: light = sample_constant(emitter, point.normal, rng, bug); break;
        }
        double cosine = dot(point.normal, light.to_light);
        if (cosine <= 0 || largest(light.irradiance) == 0) continue;
        if (bug == Bug::no_receiver_cosine) cosine = 1;
        if (is_visible(scene, point.above, light, bug)) sum = sum + light.irradiance * cosine;
    }
    return sum;
}

// The radiance that arrives at the start of the ray.
Rgb incoming_radiance(const Scene& scene, const Ray& ray, Rng& rng, Bug bug) {
    // Find the first shape on the way. Where there is none, the environment is seen.
    double distance = infinity;
    const Shape* shape = nullptr;
    for (const Shape& candidate : scene.shapes) {
        const double d = intersect(candidate, ray);
        if (d < distance) {
            distance = d;
            shape = &candidate;
        }
    }
    if (!shape) {
        Rgb sum;
        for (const Emitter& emitter : scene.emitters)
            if (emitter.kind == EmitterKind::constant) sum = sum + emitter.power;
        return sum;
    }

    // Emitters shine and diffuse surfaces reflect from their front only.
    SurfacePoint point = point_at(ray, *shape, distance, bug);
    const bool is_front = dot(point.normal, ray.direction) < 0;
    const Rgb emitted = is_front || bug == Bug::two_sided_light ? shape->radiance : Rgb{};
    if (largest(shape->reflectance) == 0) return emitted;
    if (!is_front && bug != Bug::two_sided_surface) return emitted;
    if (!is_front) {
        point.normal = point.normal * -1;
        point.above = point.position * 2 - point.above;
    }

    // A diffuse BRDF is rho / pi.
    double inverse_pi = 1 / pi;
    if (bug == Bug::no_inverse_pi) inverse_pi = 1;
    if (bug == Bug::extra_pi) inverse_pi = 1 / (pi * pi);
    return emitted + shape->reflectance * direct_irradiance(scene, point, rng, bug) * inverse_pi;
}

// --------------------------------------------------------------------------------------------- camera and images

// The ray through a point of the film, which is given in pixels from the top left corner.
Ray camera_ray(const Scene& scene, double film_x, double film_y) {
    const Camera& camera = scene.camera;
    const double x = (2 * film_x / static_cast<double>(scene.width) - 1) * camera.tan_x;
    const double y = (1 - 2 * film_y / static_cast<double>(scene.height)) * camera.tan_y;
    return {camera.origin, normalized(camera.forward + camera.right * x + camera.up * y)};
}

// Only a bug needs it: the transfer function of sRGB (IEC 61966-2-1).
double srgb_encoded(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

// The image as rows of red, green, blue, the top row first. A pixel is the average over its square.
std::vector<float> render(const Scene& scene, std::uint64_t spp, std::uint64_t seed, Bug bug) {
    std::vector<float> image(scene.width * scene.height * 3);
    const double shift = bug == Bug::half_pixel_shift ? 0.5 : 0;
    if (bug == Bug::fixed_seed) seed = 0;
    for (std::size_t y = 0; y < scene.height; ++y) {
        for (std::size_t x = 0; x < scene.width; ++x) {
            Rng rng = make_rng(seed, bug == Bug::same_noise ? 0 : y * scene.width + x);
            Rgb sum;
            for (std::uint64_t sample = 0; sample < spp; ++sample) {
                const double film_x = static_cast<double>(x) + uniform(rng) + shift;
                const double film_y = static_cast<double>(y) + uniform(rng) + shift;
                sum = sum + incoming_radiance(scene, camera_ray(scene, film_x, film_y), rng, bug);
            }
            Rgb colour = bug == Bug::no_division ? sum : sum * (1 / static_cast<double>(spp));

            // Store it, the way the film wants it.
            if (bug == Bug::red_blue_swapped) std::swap(colour.x, colour.z);
            const std::size_t column = bug == Bug::mirrored_horizontally ? scene.width - 1 - x : x;
            float* pixel = &image[(y * scene.width + column) * 3];
            for (double value : {colour.x, colour.y, colour.z}) {
                if (bug == Bug::clamped_output) value = std::min(value, 1.0);
                if (bug == Bug::srgb_output) value = srgb_encoded(value);
                if (!(value <= std::numeric_limits<float>::max())) throw std::runtime_error("a pixel is too bright");
                *pixel++ = static_cast<float>(value);
            }
        }
    }
    return image;
}

// PFM: a short text header, then rows of little endian floats; the bottom row comes first.
void write_pfm(const std::string& path, const std::vector<float>& image, const Scene& scene, Bug bug) {
    std::ofstream file(path, std::ios::binary);
    file << "PF\n" << scene.width << ' ' << scene.height << "\n-1.0\n";
    for (std::size_t row = 0; row < scene.height; ++row) {
        const std::size_t y = bug == Bug::flipped_vertically ? row : scene.height - 1 - row;
        for (std::size_t i = y * scene.width * 3; i < (y + 1) * scene.width * 3; ++i) {
            std::uint32_t bits = 0;
            std::memcpy(&bits, &image[i], sizeof bits);
            for (int shift = 0; shift < 32; shift += 8) file.put(static_cast<char>(bits >> shift & 0xff));
        }
    }
    file.close();
    if (!file) throw std::runtime_error("cannot write " + path);
}

// -------------------------------------------------------------------------------------------------- command line

constexpr const char* usage =
    "usage: student SCENE OUTPUT.pfm [--spp N] [--seed N] [--bug NAME]\n"
    "       student --list-bugs\n"
    "       student --help\n\n"
    "Renders the direct light in a JSON scene with N samples per pixel (default 16) and writes a PFM image.\n"
    "The same scene, spp and seed (default 0) always give the same image.\n";

// Thrown for a command line that makes no sense, in contrast to a bad scene.
struct UsageError {
    std::string problem;
};

// What the command line asks for.
struct Options {
    std::vector<std::string> paths;
    std::uint64_t spp = 16, seed = 0;
    Bug bug = Bug::none;
};

// A whole number from 0 to 2^64 - 1.
std::uint64_t parse_count(const std::string& text) {
    errno = 0;
    const std::uint64_t count = std::strtoull(text.c_str(), nullptr, 10);
    if (text.empty() || text.find_first_not_of("0123456789") != std::string::npos || errno == ERANGE)
        throw UsageError{"expected a whole number below 2^64, not \"" + text + "\""};
    return count;
}

Options parse_options(const std::vector<std::string>& arguments) {
    Options options;
    std::string bug_name = "none";
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const std::string& name = arguments[i];
        const bool is_last = i + 1 == arguments.size();
        if (name == "--spp" && !is_last) options.spp = parse_count(arguments[++i]);
        else if (name == "--seed" && !is_last) options.seed = parse_count(arguments[++i]);
        else if (name == "--bug" && !is_last) bug_name = arguments[++i];
        else if (name.compare(0, 2, "--") != 0) options.paths.push_back(name);
        else throw UsageError{"unknown option " + name + ", or its value is missing"};
    }
    if (options.paths.size() != 2) throw UsageError{"expected a scene and an output file; --help says more"};
    if (options.spp == 0) throw UsageError{"--spp must be at least 1"};
    for (const BugName& b : bug_names)
        if (bug_name == b.name) options.bug = b.bug;
    if (options.bug == Bug::none && bug_name != "none") throw UsageError{"--list-bugs does not name " + bug_name};
    return options;
}

int main(int argc, char** argv) {
    const std::vector<std::string> arguments(argv + std::min(argc, 1), argv + argc);
    const auto asks_for = [&arguments](const char* option) {
        return std::find(arguments.begin(), arguments.end(), option) != arguments.end();
    };
    try {
        if (asks_for("--help")) {
            std::cout << usage;
            return 0;
        }
        if (asks_for("--list-bugs")) {
            for (const BugName& b : bug_names) std::cout << b.name << '\t' << b.meaning << '\n';
            return 0;
        }
        const Options options = parse_options(arguments);
        std::ifstream file(options.paths[0], std::ios::binary);
        const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
        if (!file) throw std::runtime_error("cannot read " + options.paths[0]);
        const Scene scene = read_scene(text, options.bug);
        write_pfm(options.paths[1], render(scene, options.spp, options.seed, options.bug), scene, options.bug);
        return 0;
    } catch (const UsageError& error) {
        std::cerr << "student: " << error.problem << '\n';
        return 2;
    } catch (const std::exception& error) {
        std::cerr << "student: " << error.what() << '\n';
        return 1;
    }
}
