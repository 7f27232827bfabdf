"""Names that try to break out of the page they are written into."""

HOSTILE_JOINT = "elbow<script>alert(1)</script>&\"'<b>x</b>"
HOSTILE_LOG = "run</script><img src=x onerror=alert(2)>{{ 7 * 7 }}"
