"""What a past run looks like: one HTML page that needs nothing else, and a PNG of its panels."""
