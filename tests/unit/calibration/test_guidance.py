from calibration.guidance import GuidedSequence
from calibration.imu.guided_imu import STEPS

EVERYTHING = {
    "rest_s": 1e3, "gyro_bias_sigma_rad_s": 0.0, "turned_rad": 1e3, "gyro_scale_sigma": 0.0,
    "lever_sigma_m": 0.0, "travelled_m": 1e3, "checked_s": 1e3, "slope_sigma_m_s2": 0.0,
    "acc_scale_sigma": 0.0,
}  # fmt: skip


def test_the_first_word_is_to_land():
    advice = GuidedSequence(STEPS).update(0.0, {})
    assert advice.is_new
    assert advice.step.is_rest
    assert "Land" in advice.step.instruction


def test_a_step_ends_when_every_goal_is_reached():
    sequence = GuidedSequence(STEPS)
    sequence.update(0.0, {"rest_s": 50.0})
    early = sequence.update(10.0, {"rest_s": 60.0, "gyro_bias_sigma_rad_s": 1e-4})
    assert not early.is_new
    assert early.done == 0.5
    assert "rest_s 10 of 20 s" in early.missing
    late = sequence.update(20.0, {"rest_s": 70.0, "gyro_bias_sigma_rad_s": 1e-4})
    assert late.is_new
    assert late.step.name == "turn"


def test_amounts_count_from_the_beginning_of_their_step():
    sequence = GuidedSequence(STEPS)
    sequence.update(0.0, {})
    known = {name: (0.0 if "sigma" in name else 1e3) for name in EVERYTHING}
    assert sequence.update(1.0, known).step.name == "turn"
    assert sequence.update(2.0, known).done == 0.0


def test_a_step_that_leads_nowhere_is_given_up_and_said_so():
    sequence = GuidedSequence(STEPS)
    sequence.update(0.0, {})
    advice = sequence.update(STEPS[0].longest_s + 1.0, {"rest_s": 3.0, "gyro_bias_sigma_rad_s": 1e-5})
    assert advice.step.name == "turn"
    assert sequence.outcomes["rest"].startswith("given up after 120 s: rest_s 3 of 20 s")


def test_after_the_last_step_there_is_nothing_to_do():
    sequence = GuidedSequence(STEPS)
    known = dict(EVERYTHING)
    for k in range(2 * len(STEPS) + 2):
        known = {name: value + (1e3 if "sigma" not in name else 0.0) for name, value in known.items()}
        advice = sequence.update(float(k), known)
    assert advice.step is None
    assert set(sequence.outcomes.values()) == {"enough data"}
