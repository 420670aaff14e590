"""Every public name of the C++ engine has a counterpart in Python, or stands here with the reason why not."""

import re
from pathlib import Path

import pytest

import fieldmark as fm
from fieldmark import engine

ROOM = Path(__file__).resolve().parent.parent.parent / "engine"
INCLUDE = ROOM / "include" / "fieldmark" / "engine"

# What Python calls by another name, or offers as a method.
OTHER_NAMES = {
    "add": "Value_float32.__add__", "sub": "Value_float32.__sub__", "mul": "Value_float32.__mul__",
    "scale": "Value_float32.__mul__", "div": "Value_float32.__truediv__", "pow": "Value_float32.__pow__",
    "batched_matmul": "matmul", "broadcast_rows": "broadcast_to", "gather_rows": "gather",
    "gradcheck_module": "gradcheck", "adam_ranges": "AdamGroup", "AdamRange": "AdamGroup",
    "grad_norm": "Parameters_float32.grad_norm", "clip_grad_norm": "Parameters_float32.clip_grad_norm",
    "TapeInspector": "Inspector", "TensorStats": "Inspector_float32.gradient_stats",
    "tensor_stats": "Inspector_float32.value_stats", "stats_table": "Inspector_float32.gradient_stats",
    "gradient_stats": "Parameters_float32.gradient_stats", "value_stats": "Parameters_float32.value_stats",
    "ParamStore": "Parameters", "Params": "Parameters", "ParamRole": "Parameters_float32.role",
    "ParamId": "Parameters_float32.names", "Var": "Value", "InputProducts": "vjp", "VarFunction": "vjp",
    "Jvp": "jvp", "DualFunction": "jvp", "name_matches": "AdamGroup.names",
    "is_trained": "Parameters_float32.role", "GradcheckFn": "gradcheck",
    "ModuleGradcheckFn": "gradcheck", "CounterRng": "dropout",
}
# Structs and enumerations that Python spells as arguments.
ARGUMENTS = {"Activation", "Axes", "KeepAxes", "ConvWindow", "Interpolation", "MaxPool", "Triangle"}
LEFT_OUT = {
    "ConvMethod": "Python's conv2d has a window, whose method the engine chooses",
    "GradcheckCase": "an entry of the list that `fieldmark gradcheck` runs",
    "HasVelocity": "a concept of C++",
    "orthogonalise": "a step of Muon",
    "PackedWeights": "an optimisation of loops in C++",
    "TapeObserver": "the inspector's interface",
    "parallel_for": "loops in C++", "ScopedThreads": "fm.set_threads() sets the number of threads",
    "permutation": "NumPy draws permutations",
}
HEADERS_LEFT_OUT = {
    "aligned": "memory of C++", "arena": "memory of C++",
    "values": "a helper of ops", "shape_checks": "a helper of ops",
    "chain": "C++ expressions that the compiler fuses", "chain_steps": "C++ expressions that the compiler fuses",
    "ops/fused": "C++ expressions that the compiler fuses", "dual": "the tangents that jvp() hands to f",
    "gradcheck_second_order": "checks of the engine's own tangents", "eigen": "NumPy maps tensors",
    "tensor": "NumPy's arrays",
    "shape": "tuples", "isa": "chosen by FIELDMARK_ISA", "packed_weights": "an optimisation of loops in C++",
    "sharded_loop": "loops over shards in C++", "training_run": "loops in C++; fm.train() and fm.embed() use it",
    "run_fingerprint": "loops in C++; fm.train() and fm.embed() use it", "model_file": "Field.load() and Owner.load()",
    "nn": "includes all layers", "ops": "includes all ops", "ops/operators": "the operators of values",
}


def units():
    """The stems of the engine's public headers."""
    text = re.search(r"UNITS(.*?)\bINTERNAL", (ROOM / "CMakeLists.txt").read_text(), re.DOTALL).group(1)
    return [unit for unit in text.split() if not unit.startswith("dual/")]


def statements(unit):
    """The declarations of a header outside of classes, functions and the namespace `detail`."""
    text = re.sub(r"//[^\n]*|^#[^\n]*", "", (INCLUDE / f"{unit}.h").read_text(), flags=re.MULTILINE)
    text = re.sub(r"namespace detail \{.*?\n\}", "", text, flags=re.DOTALL)
    text = re.sub(r"namespace fieldmark \{", "", text)
    depth, outside = 0, ""
    for c in text:
        depth += c == "{"
        if depth == 0:
            outside += c
        elif c == "{" and depth == 1:
            outside += "{;"
        depth -= c == "}" and depth > 0
    return [re.sub(r"\s+", " ", s).strip() for s in outside.split(";")]


def names(unit):
    """The public names that a header declares, except names that are only announced."""
    found = set()
    for s in statements(unit):
        s = re.sub(r"template ?<class> class \w+", "class", s)  # a parameter, not a name
        s = re.sub(r"^(template ?<.*?> )+(?=\w)", "", s)
        declared = (re.match(r"(?:class|struct|enum class) (\w+).*\{$", s) or re.match(r"(?:using|concept) (\w+) =", s)
                    or re.search(r"(?<![\w:.])(\w+)\(", s))
        if declared and declared.group(1) not in ("static_assert", "extern"):
            found.add(declared.group(1))
    return {name for name in found if not name.endswith("Options")}  # those are arguments


def counterpart(name):
    """Whether a dotted name is in fieldmark.engine or in fieldmark."""
    for place in (engine, fm):
        try:
            for part in name.split("."):
                place = getattr(place, part)
            return True
        except AttributeError:
            pass
    return False


def test_the_search_finds_what_headers_declare():
    assert names("ops/conv2d") == {"conv2d", "ConvMethod", "ConvWindow"}
    assert names("ops/math") >= {"sqrt", "clamp", "log1p"} and names("nn/embedding") == {"Embedding"}
    assert names("products") >= {"jvp", "vjp", "hvp"} and names("state_file") >= {"save_state", "load_state"}
    assert names("adam") == {"Adam", "AdamRange", "AdamGroup", "adam_ranges"}
    assert len(units()) > 55 and all((INCLUDE / f"{unit}.h").exists() for unit in units())


@pytest.mark.parametrize("unit", units())
def test_every_public_name_has_a_counterpart_or_a_reason(unit):
    if unit in HEADERS_LEFT_OUT:
        return
    declared = names(unit)
    assert declared, "a header without names needs an entry in HEADERS_LEFT_OUT"
    missing = [name for name in sorted(declared - ARGUMENTS - set(LEFT_OUT))
               if not counterpart(OTHER_NAMES.get(name, name))]
    assert not missing, f"{unit}.h: bind {missing} in Python, or give the reason in {Path(__file__).name}"


def test_the_lists_name_only_what_exists_and_is_missing():
    declared = set().union(*map(names, units()))
    for name in (*OTHER_NAMES, *ARGUMENTS, *LEFT_OUT):
        assert name in declared, f"{name} is no longer in the engine"
    assert set(HEADERS_LEFT_OUT) <= set(units())
    assert not [name for name in LEFT_OUT if counterpart(name)], "bound by now"
    assert all(counterpart(name) for name in OTHER_NAMES.values())
