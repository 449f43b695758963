"""The console of a flight as people use it: on a phone, a tablet, a laptop."""

import os
import signal

import pytest

pytestmark = pytest.mark.slow
S = 1000
FLYING_MS = 90 * S
FRESH = "() => document.getElementById('connection').textContent === 'live'"
HOLDS = "() => document.getElementById('lease').textContent.startsWith('you hold control')"
WORDS = "() => [...document.querySelectorAll('.vehicle .words')].every((each) => %s)"
ALL_FLY = "each.textContent.startsWith('flying')"
ALL_LATCHED = "each.textContent.includes('stop is latched')"


def wait_until(page, condition, timeout_ms=FLYING_MS):
    """Wait until the words of every vehicle meet a condition."""
    page.wait_for_function(WORDS % condition, timeout=timeout_ms)


def take_control(page, name="anna"):
    page.get_by_role("button", name="As …").click()
    page.get_by_label("Your name").fill(name)
    page.get_by_role("button", name="Take it").click()
    page.wait_for_function(HOLDS)


def give_control(page):
    page.get_by_role("button", name="Give control").click()
    page.wait_for_function("() => document.getElementById('lease').textContent === 'nobody holds control'")


@pytest.fixture
def page(opened, flight):
    found = opened(flight.address)
    wait_until(found, ALL_FLY)
    return found


def test_everything_has_the_name_that_people_and_tests_look_for(page):
    page.wait_for_function(FRESH)
    assert page.get_by_role("button", name="STOP").is_visible()
    assert page.get_by_role("region", name="Connection").inner_text() == "live"
    assert page.get_by_role("region", name="Faults").is_visible()
    table = page.get_by_role("img", name="Table")
    assert table.is_visible()
    said = page.locator(f"#{table.get_attribute('aria-describedby')}")
    page.wait_for_function(
        "() => /alpha at x -?\\d\\.\\d\\d m, y -?\\d\\.\\d\\d m, heading -?\\d+ deg/.test("
        "document.getElementById('poses').textContent)"
    )
    assert "beta at x" in said.inner_text()
    for vehicle in ("alpha", "beta"):
        card = page.get_by_role("region", name=vehicle, exact=True)
        for button in ("Arm", "Disarm", "Float on", "Float off"):
            assert card.get_by_role("button", name=button, exact=True).is_visible()
        assert "flying" in card.inner_text()


def test_without_control_only_what_takes_motion_away_can_be_asked_for(page):
    card = page.get_by_role("region", name="alpha", exact=True)
    assert card.get_by_role("button", name="Arm", exact=True).is_disabled()
    assert card.get_by_role("button", name="Disarm", exact=True).is_enabled()
    take_control(page)
    assert card.get_by_role("button", name="Arm", exact=True).is_enabled()
    give_control(page)


def test_two_operators_cannot_both_hold_control(page, opened, flight):
    take_control(page)
    other = opened(flight.address, "tablet")
    other.get_by_role("button", name="Take control").click()
    other.wait_for_function("() => document.getElementById('lease-trouble').textContent.includes('anna')")
    give_control(page)
    other.get_by_role("button", name="Cancel").click()
    other.get_by_role("button", name="Take control").click()  # one tap, no name asked for
    other.wait_for_function(HOLDS)
    give_control(other)


def test_a_goal_is_pointed_at_flown_ahead_and_then_sent(page, api):
    take_control(page)
    page.wait_for_function(FRESH)
    table = page.get_by_role("img", name="Table")
    box = table.bounding_box()
    page.mouse.click(box["x"] + 0.42 * box["width"], box["y"] + 0.2 * box["height"])
    plan = page.get_by_role("region", name="Flown ahead")
    plan.get_by_text("settled after").wait_for(timeout=200 * S)
    goal = api(page)["vehicles"]["alpha"]["control"]
    plan.get_by_role("button", name="Send").click()
    plan.wait_for(state="hidden")  # only where the vehicle has accepted it
    page.get_by_text("anna: go_to").first.wait_for()
    assert goal["controller"] == "go_to"
    give_control(page)


def test_a_controller_is_changed_and_what_it_cannot_fly_is_refused(page, api):
    take_control(page)
    card = page.get_by_role("region", name="alpha", exact=True)
    card.get_by_text("Controller", exact=True).click()
    card.get_by_label("alpha: controller").select_option("station")
    card.get_by_role("button", name="Change controller").click()
    page.wait_for_function("() => document.getElementById('notice').textContent === 'alpha flies by station'")
    page.wait_for_function(  # its status comes five times a second
        "() => [...document.querySelectorAll('[aria-label=alpha] dd')]"
        ".some((each) => each.innerText === 'station')"
    )
    card.get_by_label("alpha: controller").select_option("follow")
    card.get_by_label("alpha: parameters").fill('{"leader": "nobody"}')
    card.get_by_role("button", name="Change controller").click()
    page.wait_for_function("() => document.getElementById('notice').textContent.includes('nobody')")
    assert api(page)["vehicles"]["alpha"]["control"]["controller"] == "station"
    give_control(page)


def test_the_space_bar_is_a_letter_where_one_types_and_the_stop_on_a_ticked_box(page):
    page.evaluate("() => { window.pressed = 0; document.getElementById('notice').textContent = ''; }")
    page.get_by_label("Note").press("Space")
    assert page.get_by_label("Note").input_value() == " "
    box = page.get_by_role("group", name="Layers").get_by_role("checkbox").first
    ticked = box.is_checked()
    page.evaluate(  # a press that is sent would end the flight of all tests
        """() => { window.fetch = () => new Promise(() => {});
          WebSocket.prototype.send = (text) => { window.pressed += text.includes('"stop"') ? 1 : 0; }; }"""
    )
    box.focus()
    page.keyboard.press("Space")
    page.wait_for_function("() => window.pressed === 1")
    assert box.is_checked() == ticked


def test_a_screen_says_within_a_second_that_what_it_shows_is_old(page, flight):
    page.wait_for_function(FRESH)
    console = flight.child("console")
    os.kill(console, signal.SIGSTOP)
    try:
        page.wait_for_function(
            "() => document.getElementById('connection').textContent === 'stale'", timeout=S
        )
    finally:
        os.kill(console, signal.SIGCONT)
    page.wait_for_function(FRESH)


def test_a_server_that_dies_is_reported_and_comes_back_and_nothing_lands(page, flight, api):
    page.wait_for_function(FRESH)
    os.kill(flight.child("console"), signal.SIGKILL)
    page.wait_for_function(
        "() => document.getElementById('connection').textContent === 'disconnected'", timeout=S
    )
    assert page.get_by_role("button", name="STOP").is_visible()
    page.wait_for_function(FRESH, timeout=60 * S)
    assert all(vehicle["mode"] == "flying" for vehicle in api(page)["vehicles"].values())


def test_strips_show_any_field_and_are_saved(page):
    page.get_by_role("tab", name="Charts").click()
    page.get_by_label("Field").fill("alpha/imu.rate_body_rad_s")
    page.get_by_role("button", name="Add").click()
    strip = page.locator(".strip", has_text="alpha/imu.rate_body_rad_s")
    strip.locator("canvas").wait_for()
    page.wait_for_function(
        "() => [...document.querySelectorAll('.strip')].at(-1).querySelector('.small')"
        ".textContent.match(/\\d/)"
    )
    for _ in range(100):  # until samples of a fifth of a second have come
        with page.expect_download() as waiting:
            page.get_by_role("button", name="Save CSV").click()
        text = waiting.value.path().read_text()
        assert text.startswith("t_s,field,value,note\n")
        if text.count('"alpha/imu.rate_body_rad_s"') > 20:
            break
    else:
        pytest.fail("samples do not gather")
    with page.expect_download() as waiting:
        page.get_by_role("button", name="Save PNG").click()
    assert waiting.value.path().read_bytes().startswith(b"\x89PNG")
    page.get_by_label("Field").fill("no_such_field")
    page.get_by_role("button", name="Add").click()
    page.get_by_text("no field is called no_such_field").wait_for()


def test_no_request_leaves_this_host_and_the_page_is_light(page, flight):
    entries = page.evaluate(
        "performance.getEntriesByType('resource').map((e) => [e.name, e.encodedBodySize])"
    )
    assert all(name.startswith(flight.address) for name, _ in entries)
    assert sum(size for _, size in entries) < 400_000


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("tab", ["table", "charts", "camera", "health", "wizards"])
def test_axe_finds_nothing_serious(opened, flight, scheme, tab):
    axe = pytest.importorskip("axe_core_python.sync_playwright")
    page = opened(flight.address, "laptop", scheme)
    page.wait_for_function(FRESH)
    page.click(f"#tab-{tab}")
    found = axe.Axe().run(page)["violations"]
    grave = [
        f"{each['id']}: {each['nodes'][0]['html']}"
        for each in found
        if each["impact"] in ("serious", "critical")
    ]
    assert not grave


def test_a_note_reaches_the_list_of_events(page):
    page.get_by_label("Note").fill("lamp switched off")
    page.get_by_role("button", name="Mark").click()
    page.get_by_text("lamp switched off").wait_for()


def test_a_vehicle_is_landed_armed_and_flown_again(page, api):
    take_control(page)
    card = page.get_by_role("region", name="beta", exact=True)
    card.get_by_role("button", name="Land", exact=True).click()
    beta = "document.querySelector('[aria-label=beta] .words').textContent"
    page.wait_for_function(f"() => {beta}.startsWith('landed')", timeout=30 * S)
    arm = card.get_by_role("button", name="Arm", exact=True)
    for _ in range(100):  # it is refused, with the reason, until the rest has lasted
        arm.click()
        page.wait_for_timeout(200)
        if api(page)["vehicles"]["beta"]["valves"]["armed"]:
            break
    assert api(page)["vehicles"]["beta"]["valves"]["armed"]
    assert not api(page)["vehicles"]["beta"]["valves"]["floating"]
    card.get_by_role("button", name="Fly", exact=True).click()
    page.wait_for_function(
        "() => document.getElementById('notice').textContent.includes('float_on lets it fly')"
    )
    card.get_by_role("button", name="Disarm", exact=True).click()
    page.wait_for_function(f"() => {beta}.startsWith('landed')", timeout=30 * S)
    card.get_by_role("button", name="Fly", exact=True).click()
    page.wait_for_function(f"() => {beta}.startsWith('flying')", timeout=FLYING_MS)
    give_control(page)


@pytest.mark.parametrize("size", ["phone", "tablet", "laptop"])
def test_stop_is_within_reach_on_every_screen(opened, flight, size):
    page = opened(flight.address, size)
    page.wait_for_function(FRESH)
    box, view = page.get_by_role("button", name="STOP").bounding_box(), page.viewport_size
    assert box["x"] >= 0
    assert box["y"] >= 0
    assert box["x"] + box["width"] <= view["width"]
    assert box["y"] + box["height"] <= view["height"]
    assert box["height"] >= 44


def test_one_tap_stops_all_while_the_charts_are_dead_and_the_next_is_announced(opened, flight):
    page = opened(flight.address, "phone")  # the last of the module: nobody flies after it
    wait_until(page, ALL_FLY)
    page.evaluate("() => { window.uPlot = null; document.getElementById('strips').remove(); }")
    page.get_by_role("button", name="STOP").tap()
    wait_until(page, ALL_LATCHED, 10 * S)
    page.get_by_text("press again").wait_for()
