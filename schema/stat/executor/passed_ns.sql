-- description: How much time of some kind there was up to a moment. `stretch` is the last stretch
--     of such time that began by then, with the sum of the earlier ones (before_ns).
CREATE OR REPLACE MACRO derive.passed_ns(stretch, at_ns) AS
coalesce(stretch.before_ns + least(at_ns, stretch.end_ns) - stretch.start_ns, 0)
