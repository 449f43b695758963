"""What is wrong with a campaign."""

from groundstation.declarations.errors import UsageError


class CampaignError(UsageError):
    """A campaign cannot be begun or continued as it was asked; the text is one sentence."""
