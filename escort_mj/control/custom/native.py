"""How the native loop calls what plugins bring: through a table of addresses, by numbers that tell content.

A block of numbers in the plan holds the parameters; it begins with the number under which the process knows
the function. What numba compiled and what Python calls back have the same C signature, that of numba's
compiled functions, so a call is one call: of machine code, or into the interpreter.
"""

from __future__ import annotations

import ctypes
import hashlib
import threading
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from escort_mj.components.component import layout_of
from escort_mj.components.equations import NUMBER, Answer, Equations, kind_word
from escort_mj.components.setup import MissionSetup
from escort_mj.components.views import LawView
from escort_mj.errors import CompilerMissingError, PluginError
from escort_mj.native import artifacts, cache
from escort_mj.native.fields import Array
from escort_mj.native.kernels import DOUBLE, external, place, vector_at
from escort_mj.native.lanes import WIDTH
from escort_mj.native.memory import Layout, layout_with
from escort_mj.native.on_demand import CLASSES
from escort_mj.native.vectors import Vec
from escort_mj.plugin_calls import place_of, step

MOST = 512  # functions of plugins that a process knows
RAISED = 1  # status of a call that raised an error
NONE = -2  # status of numba's functions that return nothing
WRONG = -2  # less the robot, in place of a robot: what was written for it is wrong, see `wrong`

_table = (ctypes.c_int64 * (1 + 2 * MOST))()  # how many; then number and address of each
_lock = threading.Lock()


class Slot(NamedTuple):
    """A function of a plugin, for one class of axes.

    Attributes:
        model: The component.
        layout: Of its parameters.
        function: What runs, in Python: the compiled function's source, or the plain form.
        keep: What must live as long as its address is known.
        address: Of the machine code.
    """

    model: type[Equations]
    layout: Layout
    function: Callable[..., Any]
    keep: Any
    address: int


class PluginFailure(NamedTuple):
    """An error that a plugin raised in a step.

    Attributes:
        time: Of the step [s].
        message: Where and what, in one line.
    """

    time: float
    message: str


_slots: dict[int, Slot] = {}
_seen: dict[int, dict[int, Callable[..., Any]]] = {}  # by addresses of state and block: calls of methods
_failures: dict[int, PluginFailure] = {}  # by address of the state


def block_of(own: Equations, setup: MissionSetup) -> Array:
    """The numbers of a component for the plan; what it runs is compiled or found.

    Raises:
        CompilerMissingError: If it has to be compiled, and numba is not installed.
        PluginError: If it cannot be compiled.
    """
    number = ready(type(own), setup.axes)
    block: Array = _slots[number].layout.pack({"p": setup.axes}, own.packed(setup))
    return block


def ready(model: type[Equations], axes: int) -> int:
    """Makes a law or behavior callable for missions of so many axes.

    Returns:
        The number under which it is known.

    Raises:
        PluginError: If it cannot be compiled.
    """
    known = axes if axes in CLASSES else None
    text = f"{model.digest} {model.__module__}.{model.__qualname__} {known} {model.compiled}"
    number = int.from_bytes(hashlib.sha256(text.encode()).digest()[:6])
    with _lock:
        if number not in _slots:
            layout = layout_of(model, number)
            slot = _compiled(model, layout, text, known) if model.compiled else _called_back(model, layout)
            place = _table[0]
            if place >= MOST:
                raise PluginError(f"more than {MOST} components of plugins in one process")
            _table[1 + 2 * place], _table[2 + 2 * place] = number, slot.address
            _slots[number] = slot
            _table[0] = place + 1
    return number


def _compiled(model: type[Equations], layout: Layout, text: str, known: int | None) -> Slot:
    """Machine code that evaluates a component's equations, from the cache or compiled."""
    name, method = hashlib.sha256(f"{text} equations".encode()).hexdigest(), getattr(model, model.method)
    kept = artifacts.kept_plugged(name) if model.digest else None
    if kept is not None:
        return Slot(model, layout, method, kept, artifacts.load_plugged(kept))
    if cache.version("numba") == "none":
        raise CompilerMissingError(
            f"{_place(method)}: {model.__name__} is a {kind_word(model)} to be compiled"
        )
    from escort_mj.native.compiler.plugged import NotCompiledError, compile_function, in_kernels

    equations = {each: in_kernels(function) for each, function in model.equations().items()}
    run, given = model.evaluation(in_kernels, equations), _given(model, layout, text, known)
    called = f"the {kind_word(model)} {model.__name__}"
    try:
        keep, address, plugged = compile_function(run, given, model.answers, method, called)
    except NotCompiledError as error:
        raise PluginError(str(error)) from None
    if plugged is not None and model.digest:
        artifacts.keep_plugged(name, plugged)
    return Slot(model, layout, method, keep, address)


def _given(model: type[Equations], layout: Layout, text: str, known: int | None) -> tuple[Any, ...]:
    """The views that a compiled function is handed."""
    view = model.view
    return (
        (f"plugin {text}", layout, layout.plan, None),
        (view.__name__, layout_with(view), view, known),
    )


def _called_back(model: type[Equations], layout: Layout) -> Slot:
    """A C function that calls Python."""
    function = getattr(model, model.method)

    def call(result: int, error: int, own: int, _: int, plan: int, state: int, *robot: int) -> int:
        if state in _failures:
            return RAISED
        try:
            known = _seen.get(state)
            call = None if known is None else known.get(own)
            first = call is None
            if call is None:
                call = _call_of(model, layout, own, plan, state)
            returned = step(function, first, partial(call, *robot) if robot else call)
            if robot:
                if returned not in ((0, 1) if model.answers else (None,)):
                    expected = model.answers or "nothing"
                    raise TypeError(f"{model.method} returned {returned!r}; expected {expected}")
                ctypes.c_int64.from_address(result).value = int(returned or 0)
        except BaseException as raised:  # no error can pass through compiled code
            _failures[state] = PluginFailure(_time(plan, state), place_of(raised, function))
            return RAISED
        return 0

    words = [ctypes.c_void_p] * 2 + [ctypes.c_int64] * (4 if model.answers is None else 5)
    callback = ctypes.CFUNCTYPE(ctypes.c_int32, *words)(call)
    return Slot(model, layout, function, callback, ctypes.cast(callback, ctypes.c_void_p).value or 0)


def _call_of(model: type[Equations], layout: Layout, own: int, plan: int, state: int) -> Callable[..., Any]:
    """Make what calls a component's method in a mission; what is not to be written cannot be."""
    parameters = model.unpacked(layout.read(layout.plan, own, own)._asdict())
    view = layout_with(model.view).read(model.view, plan, state)
    made = []
    for name, value in view._asdict().items():
        if isinstance(value, np.ndarray) and name not in model.outputs + model.scratch:
            value = np.asarray(value.data.toreadonly())  # of which nobody can take the seal off
        made.append(value)
    view = type(view)(*made)
    _seen.setdefault(state, {})[own] = found = _in_python(parameters, view)
    return found


def _in_python(own: Equations, view: Any) -> Callable[..., Any]:
    """Return what evaluates a component's equations in Python."""
    if (found := own.over_arrays(view)) is not None:
        return found
    model = type(own)
    equations = {
        name: _returning(name, function, model.answer_of(name))
        for name, function in model.equations().items()
    }
    return partial(_with_any_lanes, model.evaluation(lambda function: function, equations), own, view)


def _returning(name: str, function: Callable[..., Any], answer: Answer) -> Callable[..., Any]:
    """Return an equation; what it returns is looked at."""
    kinds: Any = answer[0]

    def evaluate(parameters: Any, r: Any) -> Any:
        found: Any = function(parameters, r)
        if kinds is NUMBER[0] and type(found) is np.ndarray:
            if answer is NUMBER and _is_lanes(found):
                return found
            found = found[()]  # the number, where the array has no more
        if not isinstance(found, kinds):
            plain = f"{found!r:.80}" if kinds is NUMBER[0] else type(found).__name__
            said = "a vector" if isinstance(found, Vec) else plain
            raise TypeError(f"{name} returned {said}; expected {answer[1]}")
        parts = found if isinstance(found, Vec) else ()
        if wrong := [part for part in parts if not (_is_lanes(part) or isinstance(part, NUMBER[0]))]:
            raise TypeError(f"{name} returned a vector with {wrong[0]!r:.80}; expected numbers")
        return float(found) if kinds is NUMBER[0] else found

    return evaluate


def _is_lanes(found: Any) -> bool:
    """Whether something is an array of the numbers of eight axes, or of one number."""
    return type(found) is np.ndarray and found.dtype == float and found.shape in ((), (WIDTH,))


def _with_any_lanes(evaluate: Callable[..., Any], own: Any, view: Any, *first: int) -> Any:
    """Evaluate equations of eight robots at a time: lanes past the last robot hold anything."""
    with np.errstate(all="ignore"):
        return evaluate(own, view, *first)


def _time(plan: int, state: int) -> float:
    """Time of a mission's present step [s]."""
    layout = layout_with(LawView)
    offset = int(vector_at(plan, layout.header_size)[layout.fields[LawView]["time"].place])
    return float(vector_at(state + DOUBLE * offset, 1)[0])


def invoke(number: int, own: int, plan: int, state: int, robot: int | None = None) -> int | None:
    """Calls a law or behavior as the native loop does.

    Args:
        number: Under which it is known.
        own: Address of its parameters.
        plan: Address of the plan.
        state: Address of the state.
        robot: Which robot, of a behavior.

    Returns:
        What it returned; None if it raised an error, see `failure`.
    """
    given = [own, own, plan, state, *([] if robot is None else [robot])]
    words = [ctypes.c_void_p] * 2 + [ctypes.c_int64] * len(given)
    function = ctypes.CFUNCTYPE(ctypes.c_int32, *words)(_slots[number].address)
    result, error = ctypes.c_int64(), ctypes.c_void_p()
    status = function(ctypes.addressof(result), ctypes.addressof(error), *given)
    if status not in (0, NONE):
        _note_failure(own, plan, state, -1 if robot is None else robot)
        return None
    return result.value


def _interpret(slot: Slot, own: int, plan: int, state: int, robot: int | None) -> None:
    numbers = slot.layout.read(slot.layout.plan, own, own)
    view = layout_with(slot.model.view).read(slot.model.view, plan, state)
    more = [] if slot.model.answers is None else [robot]
    _in_python(slot.model.unpacked(numbers._asdict()), view)(*more)


def forget(state: int) -> None:
    """A mission begins in the memory at an address: whatever was noted of an earlier one there is past."""
    _seen.pop(state, None)
    _failures.pop(state, None)


def any_failure() -> bool:
    """Return whether a plugin has raised an error in any mission of this process."""
    return bool(_failures)


def failure(state: int) -> PluginFailure | None:
    """The error that a plugin raised in the mission whose state is at an address; None if there was none."""
    return _failures.get(state)


def _place(function: Callable[..., Any]) -> str:
    return f"{function.__code__.co_filename}:{function.__code__.co_firstlineno}"


@ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 4)
def _note_failure(own: int, plan: int, state: int, robot: int) -> None:
    """Notes why a call failed; of compiled code the same is done again in Python, which says where."""
    if state in _failures:
        return
    slot = _slots.get(int(vector_at(own, 1)[0]))
    words = "the model needs a plugin that this process has not loaded"
    if slot is not None and robot <= WRONG:
        view = layout_with(slot.model.view).read(slot.model.view, plan, state)
        given = slot.model.wrong(view, WRONG - robot + 1)
        words = f"{_place(slot.function)}: {slot.model.__name__} gave {given}"
    elif slot is not None:
        words = f"{_place(slot.function)}: the compiled form raised an error that its Python form does not"
        try:
            _interpret(slot, own, plan, state, robot)
        except BaseException as raised:
            words = place_of(raised, slot.function)
    _failures[state] = PluginFailure(_time(plan, state), words)


table_address = place("escort_mj.plugins.table", ctypes.addressof(_table))


@external(ctypes.cast(_note_failure, ctypes.c_void_p).value or 0, None, *[ctypes.c_void_p] * 4)
def note_failure(own: int, plan: int, state: int, robot: int) -> None:
    """Tells Python that a call has failed."""
