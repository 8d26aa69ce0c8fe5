import numpy as np

from rampe_guard.core.types import ActuatorSample
from rampe_guard.core.velocity import VelocityEstimator


def feed(v: VelocityEstimator, rate: float, speed: float, noise: float = 0.0) -> None:
    rng = np.random.default_rng(0)
    for k in range(int(rate)):
        t = k / rate
        q = np.array([speed * t + noise * rng.standard_normal()])
        v.update(ActuatorSample(t, q, None, t))


def test_slope_of_a_straight_motion_at_any_rate() -> None:
    for rate in (5, 19, 100, 200):
        v = VelocityEstimator(np.array([1.0]))
        feed(v, rate, 0.4)
        np.testing.assert_allclose(v.velocity, [0.4], rtol=1e-9)


def test_encoder_noise_is_rest() -> None:
    v = VelocityEstimator(np.array([1.0]))
    feed(v, 100, 0.0, noise=2e-4)
    assert v.velocity[0] == 0.0


def test_a_measured_velocity_is_used_as_it_is() -> None:
    v = VelocityEstimator(np.array([1.0]))
    v.update(ActuatorSample(0.0, np.array([0.0]), np.array([0.7]), 0.0))
    assert v.velocity[0] == 0.7


def test_reset_forgets_motion() -> None:
    v = VelocityEstimator(np.array([1.0]))
    feed(v, 100, 0.5)
    v.reset()
    assert v.velocity[0] == 0.0
