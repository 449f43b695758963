"""Some hundred pictures as bad links leave them give no false fix, good ones are not taken for such."""

import pytest

from groundstation.star_tracking.fixes import NoFix, Refusal


@pytest.mark.slow
@pytest.mark.parametrize(("form", "seed"), [("JPEG", 1), ("raw", 23)])
def test_of_six_hundred_damaged_pictures_none_gives_a_false_fix(bench, form, seed):
    damage, damages = bench("star.damage"), bench("star.damages")
    kinds = [(form, kind) for kind in (damages.JPEG if form == "JPEG" else damages.RAW)]
    found = damage.run_damaged(kinds, 600, seed, lambda _: None)
    assert found.pictures == 600
    assert found.false.total() == 0, found.false
    assert found.refused.total() > (500 if form == "JPEG" else -1)  # the decoder knows of most
    assert found.fixes.total() < 60


@pytest.mark.slow
def test_of_good_pictures_less_than_one_in_a_hundred_is_taken_for_a_damaged_one(bench):
    damage, laboratory_of = bench("star.damage"), bench("star.laboratory")
    laboratory, product, refused, seen = laboratory_of.Laboratory(5), damage._Product(), [], 0
    for tag in laboratory_of.TAGS:
        for number, frame in enumerate(laboratory.frames(tag, 30)):
            file = damage._encode(frame.image, damage.QUALITIES[number % 4], 40 * (number % 2))
            for image in (frame.image, damage.decode_picture({}, file)):
                seen += 1
                answer = product.answer(image, None)
                is_torn = isinstance(answer, NoFix) and answer.reason is Refusal.TORN
                refused += [tag] * (is_torn or isinstance(answer, str))
    assert seen > 400
    assert len(refused) < 0.01 * seen, refused
