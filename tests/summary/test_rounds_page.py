"""The page of a campaign: it grows with the rounds."""

from dataclasses import replace

from excite_cli.campaign.records import Campaign, CampaignOptions
from excite_cli.report.page import render
from excite_cli.summary.campaign import rounds_page
from tests.campaign.test_records import WHOLE
from tests.diagnosis.synthetic_diagnosis import make_diagnosis


def test_an_empty_one_is_a_page() -> None:
    page = rounds_page(Campaign("", "", "", CampaignOptions()), "arm", {})
    assert "Round 1 goes on." in render(page)
    assert [section.anchor for section in page.sections] == ["rounds", "motions"]


def test_what_is_open_and_what_was_set_aside_is_there() -> None:
    page = rounds_page(WHOLE, "arm", {"model": "model.yaml"}, make_diagnosis())
    text = render(page)
    assert [section.anchor for section in page.sections] == [
        "errors",
        "rounds",
        "open",
        "residual",
        "motions",
    ]
    for told in ("spring on elbow", "a or b", "spent", "2.00%", "not measured yet", "12.5"):
        assert told in text
    for file in ("round_1_motion_1.csv", "round_1.h5", "a.csv", "model.yaml"):
        assert f'<a href="{file}">{file}</a>' in text
    assert "Round 1: + spring on elbow." in text
    assert page.answers[0].kind == "bad"
    good = rounds_page(replace(WHOLE, ended="complete"), "arm", {})
    assert good.answers[0].kind == "good"
