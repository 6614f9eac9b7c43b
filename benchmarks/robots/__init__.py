"""Third-party robots: their sources, the commands run on each, and the page about them."""
