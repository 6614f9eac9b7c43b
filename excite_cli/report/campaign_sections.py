"""All that a page says about one result file, in reading order."""

from excite_cli.report.campaign import Campaign
from excite_cli.report.condition_section import condition_figures, condition_section
from excite_cli.report.config_section import config_section
from excite_cli.report.margin_section import margin_figures, margin_section
from excite_cli.report.motion_section import motion_section
from excite_cli.report.page import KeyFigure, Section
from excite_cli.report.weakest_section import weakest_section


def campaign_figures(campaign: Campaign) -> tuple[KeyFigure, ...]:
    """What sums it up."""
    return (*condition_figures(campaign), *margin_figures(campaign))


def campaign_sections(campaign: Campaign, picture: bool = True) -> tuple[Section, ...]:
    """Condition numbers, what shows least, motions, margins, how it was made."""
    return (
        condition_section(campaign, picture),
        motion_section(campaign),
        margin_section(campaign),
        weakest_section(campaign),
        config_section(campaign),
    )
