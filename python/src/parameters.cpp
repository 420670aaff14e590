// Parameter stores, optimisers, and files of their state.
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/clip.h>
#include <fieldmark/engine/muon.h>
#include <fieldmark/engine/sgd.h>
#include <fieldmark/engine/state_file.h>
#include <pybind11/stl.h>

#include <cmath>
#include <optional>

#include "number_argument.h"
#include "stats_dict.h"
#include "tape_value.h"

namespace fieldmark::python {
namespace {

using namespace py::literals;

template <class T>
using StorePtr = std::shared_ptr<StoreHandle<T>>;

constexpr std::pair<const char*, ParamRole> kRoles[] = {{"trained", ParamRole::trained},
                                                        {"matrix", ParamRole::matrix},
                                                        {"table", ParamRole::table},
                                                        {"running", ParamRole::running}};

ParamRole role_of(const std::string& wanted) {
  for (const auto& [name, role] : kRoles)
    if (name == wanted) return role;
  throw ValueError("[Parameters.add] role must be trained, matrix, table or running, got '" + wanted + "'");
}

template <class T>
void add(StoreHandle<T>& s, const std::string& name, const py::object& given, const std::string& role) {
  const py::array array = borrowed<T>("Parameters.add: values", given);
  ParamStore<T>& store = s.open("Parameters.add");
  const ParamId id = store.add(name, shape_of(array), role_of(role));
  std::ranges::copy(elements<T>(array), store.values(id).begin());
}

template <class T>
std::vector<std::string> names(const StoreHandle<T>& s) {
  std::vector<std::string> names;
  for (const auto& e : s.store.entries()) names.push_back(e.name);
  return names;
}

template <class T>
std::string role(const StoreHandle<T>& s, const std::string& name) {
  const ParamRole wanted = s.store.entry(s.store.find(name)).role;
  return std::ranges::find(kRoles, wanted, &std::pair<const char*, ParamRole>::second)->first;
}

// [(name, values, role)]: all that a copy or a pickle keeps. Its gradients are 0.
template <class T>
py::tuple state_of(const StoreHandle<T>& s) {
  py::list tensors;
  for (const auto& e : s.store.entries()) {
    const auto values = s.store.values(s.store.find(e.name));
    tensors.append(
        py::make_tuple(e.name, py::array_t<T>(extents_of(e.shape), values.data()), role(s, e.name)));
  }
  return py::make_tuple(tensors);
}

template <class T>
StorePtr<T> store_from(const py::tuple& state) {
  const auto store = std::make_shared<StoreHandle<T>>();
  for (const py::handle tensor : state[0])
    std::apply([&](const auto&... part) { add(*store, part...); },
               tensor.cast<std::tuple<std::string, py::object, std::string>>());
  return store;
}

template <class T>
void bind_store(py::module_& module, const std::string& suffix) {
  using Store = StoreHandle<T>;
  py::class_<Store, StorePtr<T>>(module, ("Parameters_" + suffix).c_str(),
                                 "All parameters of a model in one buffer, with their gradients in another.")
      .def(py::init<>())
      .def("add", &add<T>, "name"_a, "values"_a, "role"_a = "trained",
           "Adds a tensor with these values, which are copied. Running ones get no gradients, and no step "
           "changes\n"
           "them.")
      .def(py::pickle(&state_of<T>, &store_from<T>))
      .def("names", &names<T>, "All names in the order added.")
      .def("role", &role<T>, "name"_a, "As declared to add(): trained, matrix, table or running.")
      .def(
          "values",
          [](StorePtr<T> s, const std::string& name) {
            const ParamId id = s->store.find(name);
            return view(s->store.values(id).data(), s->store.entry(id).shape, s, s->leases);
          },
          "name"_a, "The values of a tensor, not copied; writing changes the model.")
      .def(
          "grads",
          [](StorePtr<T> s, const std::string& name) {
            const ParamId id = s->store.find(name);
            return view(s->store.grads(id).data(), s->store.entry(id).shape, s, s->leases);
          },
          "name"_a, "The gradients of a tensor, not copied.")
      .def(
          "leaf",
          [](StorePtr<T> s, const py::object& given, const std::string& name) {
            const auto tape = tape_of<T>("Parameters.leaf", given);
            const ParamId id = s->store.find(name);
            return tape->reading(s, [&] { return Value<T>(tape, tape->params(*s).leaf(tape->tape(), id)); });
          },
          "tape"_a, "name"_a, "A parameter on a tape; a running one is a constant.")
      .def(
          "zero_grad", [](Store& s) { s.store.zero_grad(); }, "Sets all gradients to 0.")
      .def(
          "gradient_stats", [](Store& s) { return as_dict(gradient_stats(s.store)); },
          "Statistics of each gradient by name: count, zeros, nonfinite, and mean, rms and largest magnitude "
          "of what is finite.")
      .def(
          "value_stats", [](const Store& s) { return as_dict(value_stats(s.store)); },
          "Statistics of the values of each tensor by name: count, zeros, nonfinite, and mean, rms and "
          "largest "
          "magnitude of what is finite.")
      .def(
          "grad_norm", [](Store& s) { return grad_norm(std::span<const T>(s.store.grads())); },
          "The Euclidean norm of all gradients together.")
      .def(
          "clip_grad_norm", [](Store& s, double limit) { return clip_grad_norm(s.store, limit); }, "limit"_a,
          "Scales all gradients down to this norm; returns the norm that they had. ValueError if one is NaN "
          "or\n"
          "infinite.");
}

// An optimiser and the store that it updates.
template <class T, class O>
struct OptimiserHandle {
  StorePtr<T> store;
  py::capsule lease;  // blocks new parameters in the store
  O optimiser;
  void step(double factor) {
    optimiser.step(store->store.values(), store->store.grads(), factor);
    store->leases.changed();
  }
};

// Adam, on the ranges of its groups if it has any.
template <class T>
struct AdamHandle : OptimiserHandle<T, Adam<T>> {
  std::vector<AdamRange> ranges;  // empty: all parameters, with the options' rules

  void step(double factor) {
    if (ranges.empty()) return OptimiserHandle<T, Adam<T>>::step(factor);
    std::vector<AdamRange> now = ranges;
    for (AdamRange& range : now) range.lr_factor *= factor;
    this->optimiser.step(this->store->store.values(), this->store->store.grads(),
                         std::span<const AdamRange>(now));
    this->store->leases.changed();
  }
};
template <class T>
using SgdHandle = OptimiserHandle<T, Sgd<T>>;
template <class T>
using MuonHandle = OptimiserHandle<T, Muon<T>>;

template <class T>
AdamHandle<T>* adam_from(const StorePtr<T>& s, double lr, double beta1, double beta2, double eps,
                         double weight_decay, Flag skip_zero,
                         const std::optional<std::vector<AdamGroup>>& groups) {
  if (groups && groups->empty()) throw ValueError("[Adam] groups must not be empty: None stands for all");
  if (groups && (weight_decay != 0 || skip_zero))
    throw ValueError(std::string("[Adam] ") + (skip_zero ? "skip_zero" : "weight_decay") +
                     " has no effect with groups: give it to each AdamGroup");
  const AdamOptions options{.lr = lr,
                            .beta1 = beta1,
                            .beta2 = beta2,
                            .eps = eps,
                            .skip_zero = skip_zero,
                            .weight_decay = weight_decay};
  Adam<T> adam(s->store, options);
  auto ranges = groups ? adam_ranges(s->store, *groups) : std::vector<AdamRange>{};
  return new AdamHandle<T>{{s, s->leases.lend(s), std::move(adam)}, std::move(ranges)};
}

template <class T>
void bind_optimisers(py::module_& module, const std::string& suffix) {
  py::class_<AdamHandle<T>>(module, ("Adam_" + suffix).c_str(), "Adam on all tensors that are not running.")
      .def(py::init(&adam_from<T>), py::arg("parameters").none(false), "lr"_a = 1e-3, "beta1"_a = 0.9,
           "beta2"_a = 0.999, "eps"_a = 1e-8, "weight_decay"_a = 0.0, "skip_zero"_a = false,
           "groups"_a = py::none())
      .def("step", &AdamHandle<T>::step, "lr_factor"_a = 1.0, "One step; lr_factor multiplies lr.")
      .def_property_readonly(
          "steps", [](const AdamHandle<T>& a) { return a.optimiser.steps(); },
          "Steps taken, those before load_state() included.");
  py::class_<SgdHandle<T>>(module, ("Sgd_" + suffix).c_str(),
                           "Stochastic gradient descent on all tensors that are not running.")
      .def(
          py::init([](StorePtr<T> s, double lr, double momentum, Flag nesterov, double weight_decay) {
            return new SgdHandle<T>{
                s, s->leases.lend(s),
                Sgd<T>(s->store,
                       {.lr = lr, .momentum = momentum, .nesterov = nesterov, .weight_decay = weight_decay})};
          }),
          py::arg("parameters").none(false), "lr"_a = 1e-2, "momentum"_a = 0.0, "nesterov"_a = false,
          "weight_decay"_a = 0.0)
      .def("step", &SgdHandle<T>::step, "lr_factor"_a = 1.0, "One step; lr_factor multiplies lr.");
  py::class_<MuonHandle<T>>(module, ("Muon_" + suffix).c_str(), "Muon on the tensors that match a pattern.")
      .def(py::init([](StorePtr<T> s, const std::vector<std::string>& names, double lr, double momentum) {
             return new MuonHandle<T>{
                 s, s->leases.lend(s),
                 Muon<T>(s->store, names, {.lr = lr, .momentum = momentum, .zero_grads = true})};
           }),
           py::arg("parameters").none(false), "names"_a, "lr"_a = 1e-3, "momentum"_a = 0.95)
      .def("step", &MuonHandle<T>::step, "lr_factor"_a = 1.0, "One step; lr_factor multiplies lr.");
}

// Applies f to the C++ optimiser of a Python object; None: does nothing.
template <class T, class F>
void with_optimiser(const char* function, const StorePtr<T>& s, const py::object& given, F f) {
  const auto of = [&](auto& handle) {
    if (handle.store != s)
      throw ValueError("[" + std::string(function) + "] the optimiser is one of other parameters");
    f(handle.optimiser);
  };
  if (given.is_none()) return f();
  if (py::isinstance<AdamHandle<T>>(given)) return of(given.cast<AdamHandle<T>&>());
  if (py::isinstance<SgdHandle<T>>(given)) return of(given.cast<SgdHandle<T>&>());
  if (py::isinstance<MuonHandle<T>>(given)) return of(given.cast<MuonHandle<T>&>());
  throw py::type_error("[" + std::string(function) + "] optimiser must be Adam, Sgd or Muon of " +
                       dtype_name<T>() + " parameters, or None, got " + type_name(given));
}

template <class T>
void bind_state(py::module_& module) {
  module.def(
      "save_state",
      [](SafetensorsFile& file, const std::string& prefix, const StorePtr<T>& s, const py::object& optimiser,
         const std::string& part) {
        SafetensorsFile next = file;  // a copy: if a name is taken, the file is unchanged
        with_optimiser<T>("save_state", s, optimiser, [&](const auto&... o) {
          save_state(next, prefix, std::as_const(s->store), o..., part);
        });
        file = std::move(next);
      },
      "file"_a, "prefix"_a, py::arg("parameters").none(false), "optimiser"_a = py::none(), "module"_a = "",
      once<T>(
          "Adds the parameters as PREFIX + NAME, and what the optimiser keeps for them. With `module`, adds\n"
          "MODULE/NAME alone, as PREFIX + NAME, without Adam's steps. ValueError if a name is taken or no\n"
          "parameter is of the module."));
  module.def(
      "load_state",
      [](const SafetensorsFile& file, const std::string& prefix, const StorePtr<T>& s,
         const py::object& optimiser, const std::string& part) {
        with_optimiser<T>("load_state", s, optimiser,
                          [&](auto&... o) { load_state(file, prefix, s->store, o..., part); });
        s->leases.changed();
      },
      "file"_a, "prefix"_a, py::arg("parameters").none(false), "optimiser"_a = py::none(), "module"_a = "",
      once<T>(
          "Reads what save_state() added; training then goes on with the same bits. With `module`, reads\n"
          "PREFIX + NAME into MODULE/NAME and leaves all others. IoError if an array is missing or has "
          "another\n"
          "shape or type; nothing is changed then."));
}

AdamGroup group_from(const std::string& names, double lr_factor, Flag skip_zero, double weight_decay) {
  if (names.empty()) throw ValueError("[AdamGroup] names must be a pattern, got ''");
  if (!(lr_factor >= 0) || std::isinf(lr_factor))
    throw ValueError("[AdamGroup] lr_factor must be at least 0 and finite, got " + std::to_string(lr_factor));
  if (!(weight_decay >= 0) || std::isinf(weight_decay))
    throw ValueError("[AdamGroup] weight_decay must be at least 0 and finite, got " +
                     std::to_string(weight_decay));
  return {names, {.lr_factor = lr_factor, .skip_zero = skip_zero, .weight_decay = weight_decay}};
}

}  // namespace

void bind_adam_group(py::module_& module) {
  py::class_<AdamGroup>(module, "AdamGroup", "Tensors that share a step size and rules of Adam.")
      .def(py::init(&group_from), "names"_a, "lr_factor"_a = 1.0, "skip_zero"_a = false,
           "weight_decay"_a = 0.0,
           "The tensors whose names match a pattern, as in \"*bias\": * stands for any characters, ? for "
           "one.\n\n"
           "lr_factor, at least 0, multiplies Adam's lr; skip_zero leaves entries with a gradient of exactly "
           "0, and\n"
           "their moments, as they are; weight_decay is at least 0. ValueError if one is out of range.")
      .def_readonly("names", &AdamGroup::names, "Pattern of names.")
      .def_property_readonly(
          "lr_factor", [](const AdamGroup& g) { return g.settings.lr_factor; }, "Multiplies Adam's lr.")
      .def_property_readonly(
          "skip_zero", [](const AdamGroup& g) { return g.settings.skip_zero; },
          "Whether entries with a gradient of exactly 0 stay as they are.")
      .def_property_readonly(
          "weight_decay", [](const AdamGroup& g) { return g.settings.weight_decay; },
          "Decoupled: x -= lr weight_decay x.");
}

template <class T>
void bind_parameters(py::module_& module, const std::string& suffix) {
  bind_store<T>(module, suffix);
  bind_optimisers<T>(module, suffix);
  bind_state<T>(module);
}
template void bind_parameters<float>(py::module_&, const std::string&);
template void bind_parameters<double>(py::module_&, const std::string&);

}  // namespace fieldmark::python
