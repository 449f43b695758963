from groundstation.control.surroundings import Obstacle
from groundstation.supervision.apart import NEAREST_M, Others, in_the_way, too_near


def test_a_place_is_refused_with_the_distance_to_whoever_is_there():
    others = Others({"beta": (0.5, 0.1)}, {"gamma": (-0.5, 0.0)})
    assert others.objection((0.6, 0.1)) == "beta is 0.10 m from there, 0.45 m are asked for"
    assert others.objection((-0.5, 0.2)) == "the goal of gamma is 0.20 m from there, 0.45 m are asked for"
    assert others.objection((0.0, 1.0)) == ""


def test_a_place_in_an_obstacle_is_refused_with_its_name():
    others = Others(obstacles=(Obstacle("lamp", (0.5, 0.1), 0.1),))
    assert others.objection((0.6, 0.1)) == "lamp is 0.10 m from there, 0.325 m are asked for"
    assert others.objection((0.5, 0.5)) == ""
    assert in_the_way((0.5, 0.4251), others.obstacles) == ""
    assert in_the_way((0.5, 0.4249), others.obstacles)


def test_the_least_distance_itself_is_enough():
    assert too_near("beta", NEAREST_M) == ""
    assert too_near("beta", NEAREST_M - 1e-6) == "beta is 0.45 m away, 0.45 m are asked for"
