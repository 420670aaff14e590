"""Groups of parameters, and schedules of runs."""

import numpy as np
import pytest

from fieldmark import engine


def model_of(**tensors):
    model = engine.Parameters("float64")
    for name, values in tensors.items():
        model.add(name, np.array(values))
    return model


def test_each_tensor_has_the_settings_of_the_first_group_that_matches():
    model = model_of(bias=[1.0, 1.0], weight=[2.0], frozen=[3.0])
    for name in model.names():
        model.grads(name)[:] = 0.5
    adam = engine.Adam(model, lr=0.1, groups=[engine.AdamGroup("bias", lr_factor=2),
                                              engine.AdamGroup("*i*", weight_decay=0.25)])
    adam.step(lr_factor=0.5)  # the first step is lr times the sign of the gradient
    np.testing.assert_allclose(model.values("bias"), 1 - 0.1 * 2 * 0.5, rtol=1e-7)
    np.testing.assert_allclose(model.values("weight"), 2 - 0.1 * 0.5 * (1 + 0.25 * 2), rtol=1e-7)
    np.testing.assert_array_equal(model.values("frozen"), 3)
    assert adam.steps == 1


def test_entries_without_a_gradient_are_skipped_on_request():
    for options in ({"skip_zero": True}, {"groups": [engine.AdamGroup("*", skip_zero=True)]}, {}):
        model = model_of(table=[1.0, 1.0])
        adam = engine.Adam(model, lr=0.1, **options)
        for gradient in ([1.0, 1.0], [1.0, 0.0]):
            model.grads("table")[:] = gradient
            adam.step()
        moved = 1 - model.values("table")
        assert moved[0] == pytest.approx(0.2) and (moved[1] == pytest.approx(0.1)) == bool(options)


def test_groups_that_do_not_fit_are_refused():
    model = model_of(w=[1.0])
    group = engine.AdamGroup("*", lr_factor=3)
    assert (group.names, group.lr_factor, group.skip_zero, group.weight_decay) == ("*", 3, False, 0)
    for call, error, text in (
            (lambda: engine.Adam(model, groups=[]), ValueError, r"\[Adam\] groups must not be empty"),
            (lambda: engine.Adam(model, groups=[engine.AdamGroup("v")]), ValueError, r".*v"),
            (lambda: engine.Adam(model, weight_decay=0.1, groups=[group]), ValueError,
             r"\[Adam\] weight_decay has no effect with groups: give it to each AdamGroup"),
            (lambda: engine.Adam(model, skip_zero=True, groups=[group]), ValueError, r"\[Adam\] skip_zero has no effect"),
            (lambda: engine.Adam(model, groups=[3]), TypeError,
             r"\[Adam\] groups must be a sequence of AdamGroup\(\), got one of int at 0"),
            (lambda: engine.AdamGroup(""), ValueError, r"\[AdamGroup\] names must be a pattern, got ''"),
            (lambda: engine.AdamGroup("*", lr_factor=-1), ValueError, r"\[AdamGroup\] lr_factor must be at least 0"),
            (lambda: engine.AdamGroup("*", lr_factor=float("nan")), ValueError, r"\[AdamGroup\] lr_factor must be"),
            (lambda: engine.AdamGroup("*", weight_decay=float("inf")), ValueError, r"\[AdamGroup\] weight_decay must"),
            (lambda: engine.AdamGroup("*", skip_zero=1), TypeError, r"\[AdamGroup\] skip_zero must be True or False")):
        with pytest.raises(error, match="^" + text):
            call()
    model.add("still free", np.ones(1))


def test_a_schedule_of_steps_falls_and_cools_down():
    schedule = engine.Schedule(lr=0.1, steps=100, half_after=50, cooldown=0.4, last=0.01)
    assert schedule.lr(0) == pytest.approx(0.1) and schedule.lr(50) == pytest.approx(0.05)
    assert schedule.lr(80) == pytest.approx(0.1 / (1 + 80 / 50) * 0.01 ** 0.5)
    assert schedule.total == 100 and not schedule.done(99) and schedule.done(100)


def test_a_timed_schedule_fixes_its_total_from_the_steps_it_sees():
    schedule, n = engine.Schedule(seconds=10), 0
    assert schedule.total == 0
    while not schedule.done(n):
        schedule.observe(n, n * 0.1)
        n += 1
    assert 95 <= n == schedule.total <= 102 and not schedule.replanned
    other = engine.Schedule(seconds=10)
    other.resume(schedule.total, False)
    assert other.lr(99) == schedule.lr(99) < schedule.lr(0)


def test_schedules_name_what_does_not_fit():
    for call, error, text in (
            (lambda: engine.Schedule(), ValueError, r"\[Schedule\] give steps or seconds, got neither"),
            (lambda: engine.Schedule(steps=5, seconds=5), ValueError, r"\[Schedule\] give steps or seconds, got both"),
            (lambda: engine.Schedule(steps=0), ValueError, r"\[Schedule\] steps must be 1 to 2147483647, got 0"),
            (lambda: engine.Schedule(seconds=-1), ValueError, r"\[schedule\] .*seconds"),
            (lambda: engine.Schedule(steps=5, cooldown=1), ValueError, r"\[schedule\] .*cooldown"),
            (lambda: engine.Schedule(steps=1.5), TypeError, r"\[Schedule\] steps must be an integer, got float"),
            (lambda: engine.Schedule(steps=5).resume(-1, False), ValueError, r"\[Schedule.resume\] total must be")):
        with pytest.raises(error, match="^" + text):
            call()
