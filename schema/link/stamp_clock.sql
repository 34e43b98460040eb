-- name: derive.stamp_clock
-- kind: macro
-- description: How far the clock that stamps messages is from that of the traces, over time. A
--     stamp is made after the message was written and before the publishing thread went on, so
--     each pair of a message and a publication that may be its own allows an interval of
--     differences. In each stretch of time the difference that most messages allow is taken, the
--     greatest of these: the lower envelope of stamp less time of writing. It follows the stretch
--     before (both clocks are slewed a little) unless several messages agree on a jump. A message
--     taken on the clock of the publisher is looked for among the publications right before its
--     take, others among those around the stamp; a few messages per stretch are enough. Where
--     nearly as many allow a lesser difference, by which the messages would be those of later
--     publications, the clock may have jumped by a period: no message agrees then. Where messages
--     were taken on other clocks only, of several differences that many allow the sharpest counts:
--     of the right one the delays from write to stamp vary least. A drift that is too steep for
--     this to be exact tells nothing: nor does a message agree then.
-- grain: one row per clock and stretch of time with messages that agree
-- param: only_run BIGINT  Run to look at
-- needs: derive.unstamped_publication, derive.unstamped_message
CREATE OR REPLACE MACRO derive.stamp_clock(only_run) AS TABLE
WITH RECURSIVE published AS MATERIALIZED (
    SELECT
        run_id, clock_id, topic_name, publisher_id, written_ns, next_event_ns,
        row_number() OVER (PARTITION BY publisher_id ORDER BY written_ns, publication_id)
            AS position
    FROM derive.unstamped_publication(only_run)
),
message AS MATERIALIZED (
    SELECT run_id, topic_name, source_timestamp_ns, clock_id, taken_ns
    FROM derive.unstamped_message(only_run)
),
publisher AS (
    SELECT run_id, clock_id, topic_name, publisher_id, count(*) AS publication_count
    FROM published
    GROUP BY run_id, clock_id, topic_name, publisher_id
),
-- Stretches of half a second, longer where messages are few or the recording is very long, shorter
-- where it is so short that a few of them would not tell the drift.
extent AS (
    SELECT
        run_id, clock_id, start_ns, stretch_ns, 1750 + stretch_ns // 2000000 AS fine_slack_ns
    FROM (
        SELECT
            p.run_id,
            p.clock_id,
            min(p.written_ns) AS start_ns,
            max(p.written_ns) - min(p.written_ns) AS length_ns,
            greatest(
                least(5e8, length_ns / 8),
                length_ns / 600,
                least(30e9, length_ns * 8 / greatest(any_value(m.message_count), 1))
            )::BIGINT AS stretch_ns
        FROM published AS p
        CROSS JOIN (SELECT count(*) AS message_count FROM message) AS m
        GROUP BY p.run_id, p.clock_id
    )
),
placed AS (
    SELECT
        m.run_id,
        p.clock_id,
        p.publisher_id,
        p.publication_count,
        m.source_timestamp_ns,
        bool_or(m.clock_id = p.clock_id) AS is_taken_here,
        coalesce(
            min(CASE WHEN m.clock_id = p.clock_id THEN m.taken_ns END), m.source_timestamp_ns
        ) AS near_ns
    FROM message AS m
    JOIN publisher AS p ON m.run_id = p.run_id AND m.topic_name = p.topic_name
    GROUP BY m.run_id, p.clock_id, p.publisher_id, p.publication_count, m.source_timestamp_ns
),
turn AS (
    SELECT
        q.clock_id, q.publisher_id, q.source_timestamp_ns, q.is_taken_here, q.near_ns,
        x.start_ns, x.stretch_ns, (q.near_ns - x.start_ns) // x.stretch_ns AS stretch,
        q.publication_count,
        row_number() OVER (
            PARTITION BY q.publisher_id, (q.near_ns - x.start_ns) // x.stretch_ns
            ORDER BY q.source_timestamp_ns % 9973, q.source_timestamp_ns
        ) AS turn
    FROM placed AS q
    JOIN extent AS x ON q.clock_id = x.clock_id
),
-- Messages of every publisher in turn; of a topic with many publishers those of all of them.
sampled AS (
    SELECT
        clock_id, publisher_id, source_timestamp_ns, is_taken_here, near_ns, start_ns, stretch_ns
    FROM turn
    WHERE turn <= 32
    QUALIFY row_number() OVER (
        PARTITION BY clock_id, stretch
        ORDER BY turn, publication_count, source_timestamp_ns, publisher_id
    ) <= 48
),
wanted AS (
    SELECT
        s.clock_id, s.publisher_id, s.source_timestamp_ns, s.is_taken_here, s.start_ns,
        s.stretch_ns, p.position + unnest(
            CASE WHEN s.is_taken_here THEN range(-12, 1) ELSE range(-48, 49) END
        ) AS position
    FROM sampled AS s
    ASOF JOIN published AS p ON s.publisher_id = p.publisher_id AND s.near_ns >= p.written_ns
),
paired AS (
    SELECT
        w.clock_id,
        w.publisher_id,
        (p.written_ns - w.start_ns) // w.stretch_ns AS stretch,
        w.is_taken_here,
        p.written_ns,
        w.stretch_ns // 25000 AS slack_ns,
        w.source_timestamp_ns - p.written_ns AS greatest_ns,
        w.source_timestamp_ns
        - least(coalesce(p.next_event_ns, p.written_ns + 5000000), p.written_ns + 1000000000)
            AS least_ns,
        lead(w.source_timestamp_ns - p.written_ns) OVER (
            PARTITION BY w.publisher_id, w.source_timestamp_ns ORDER BY w.position
        ) AS later_ns
    FROM wanted AS w
    JOIN published AS p ON w.publisher_id = p.publisher_id AND w.position = p.position
),
-- A pair allows more than its interval, by what the difference may change within a stretch; but a
-- message has one vote: of two publications in a row the earlier has the rest.
allowed AS (
    SELECT
        clock_id, stretch, is_taken_here,
        greatest(least_ns - slack_ns, later_ns + slack_ns) AS least_ns,
        greatest_ns + slack_ns AS greatest_ns
    FROM paired
    WHERE later_ns IS NULL OR later_ns < greatest_ns
),
edge AS (
    SELECT clock_id, stretch, least_ns AS difference_ns, 1 AS step FROM allowed
    UNION ALL
    SELECT clock_id, stretch, greatest_ns, -1 FROM allowed
),
vote AS (
    SELECT
        clock_id, stretch, difference_ns, step,
        lag(step) OVER by_difference AS previous_step,
        sum(step) OVER (by_difference ROWS UNBOUNDED PRECEDING) AS vote_count
    FROM edge
    WINDOW by_difference AS (
        PARTITION BY clock_id, stretch ORDER BY difference_ns, step
    )
),
peak AS (
    SELECT clock_id, stretch, difference_ns, vote_count + 1 AS vote_count
    FROM vote
    WHERE step = -1
    QUALIFY vote_count + 1 >= max(vote_count + 1) OVER (PARTITION BY clock_id, stretch)
        * CASE WHEN previous_step = 1 THEN 0.2 ELSE 0.5 END
),
origin AS (
    SELECT clock_id, stretch, mode(is_taken_here) AS is_taken_here
    FROM allowed
    GROUP BY clock_id, stretch
),
-- Messages of a timer agree with differences one period apart. Of these the true one is sharpest:
-- what passes from a write to its stamp varies less than that and the time between two writes.
-- From one message to the next, drift is nothing.
sharp AS (
    SELECT clock_id, stretch, bucket, median(abs(step_ns)) AS spread_ns
    FROM (
        SELECT
            e.clock_id, e.stretch, e.bucket,
            a.greatest_ns - lag(a.greatest_ns) OVER (
                PARTITION BY e.clock_id, e.stretch, e.bucket, a.publisher_id
                ORDER BY a.written_ns, a.greatest_ns
            ) AS step_ns
        FROM (
            SELECT
                p.clock_id, p.stretch, p.difference_ns, p.difference_ns // 200000 AS bucket,
                p.difference_ns // 200000 + unnest([-1, 0, 1]) AS near_bucket
            FROM peak AS p
            JOIN origin AS o
                ON p.clock_id = o.clock_id AND p.stretch = o.stretch AND NOT o.is_taken_here
            QUALIFY row_number() OVER (
                PARTITION BY p.clock_id, p.stretch, p.difference_ns // 200000
                ORDER BY p.vote_count DESC, p.difference_ns
            ) = 1
        ) AS e
        JOIN paired AS a
            ON e.clock_id = a.clock_id
            AND e.stretch = a.stretch
            AND e.near_bucket = a.greatest_ns // 200000
            AND abs(a.greatest_ns - e.difference_ns) <= 200000
    )
    GROUP BY clock_id, stretch, bucket
    HAVING count(step_ns) >= 8
),
ballot AS MATERIALIZED (
    SELECT
        p.clock_id,
        p.stretch,
        row_number() OVER (PARTITION BY p.clock_id ORDER BY p.stretch) AS number,
        least(3, sum((max(p.vote_count) >= 8)::BIGINT) OVER (PARTITION BY p.clock_id)) AS patience,
        x.stretch_ns,
        any_value(o.is_taken_here) AS is_taken_here,
        max(p.vote_count) AS most,
        list(
            struct_pack(
                vote_count := p.vote_count,
                difference_ns := p.difference_ns - x.stretch_ns // 25000,
                spread_ns := h.spread_ns
            )
        ) AS peaks
    FROM peak AS p
    JOIN extent AS x ON p.clock_id = x.clock_id
    JOIN origin AS o ON p.clock_id = o.clock_id AND p.stretch = o.stretch
    LEFT JOIN sharp AS h
        ON p.clock_id = h.clock_id
        AND p.stretch = h.stretch
        AND p.difference_ns // 200000 = h.bucket
    GROUP BY p.clock_id, p.stretch, x.stretch_ns
),
-- A difference that few agree with, several times in a row, is given up for that of the latest
-- publications that many agree with: a message is taken soon after it was published. Where no
-- message was taken on this clock it is given up for the sharpest that many agree with, if no other
-- is nearly as sharp; also where it is far from the sharpest itself, as after a jump by a period.
followed (
    clock_id, number, stretch, difference_ns, vote_count, miss_count, is_ambiguous
) AS (
    SELECT clock_id, 0::BIGINT, stretch, 0::BIGINT, 0::BIGINT, 0::BIGINT, false
    FROM ballot
    WHERE number = 1
    UNION ALL
    SELECT
        clock_id,
        number,
        CASE WHEN is_missed AND NOT has_jumped THEN previous_stretch ELSE stretch END,
        CASE
            WHEN has_jumped THEN jump.difference_ns
            WHEN is_missed THEN previous_ns
            ELSE near.difference_ns
        END,
        CASE
            WHEN has_jumped THEN jump.vote_count
            WHEN is_missed OR is_rivalled THEN 0
            ELSE near.vote_count
        END::BIGINT,
        CASE WHEN has_jumped OR NOT is_missed THEN 0 ELSE miss_count + 1 END,
        is_rivalled AND NOT has_jumped
    FROM (
        SELECT
            clock_id, number, stretch, previous_stretch, previous_ns, miss_count, near, jump,
            near IS NULL
                OR (most >= 8 AND most_close < 0.6 * most)
                OR (
                    most >= 8 AND len(list_filter(
                        high_peaks,
                        lambda p: 3 * p.spread_ns < near.spread_ns
                            AND abs(p.difference_ns - near.difference_ns) > 500000
                    )) > 0
                ) AS is_missed,
            is_taken_here OR len(list_filter(
                high_peaks,
                lambda p: abs(p.difference_ns - jump.difference_ns) > 500000
                    AND coalesce(p.spread_ns < 1.5 * jump.spread_ns, true)
            )) = 0 AS is_told,
            is_missed AND is_told AND most >= 8 AND miss_count + 1 >= patience AS has_jumped,
            NOT is_missed AND is_taken_here AND most_close >= 8 AND coalesce(
                list_max(list_transform(
                    list_filter(peaks, lambda p: p.difference_ns < previous_ns - 500000),
                    lambda p: p.vote_count
                )) >= 0.9 * most_close,
                false
            ) AS is_rivalled
        FROM (
            SELECT
                *,
                list_min(list_transform(
                    list_filter(close_peaks, lambda p: p.vote_count >= 0.85 * most_close),
                    lambda p: struct_pack(
                        distance := abs(p.difference_ns - previous_ns),
                        difference_ns := p.difference_ns,
                        vote_count := p.vote_count,
                        spread_ns := p.spread_ns
                    )
                )) AS near,
                list_min(list_transform(
                    high_peaks,
                    lambda p: struct_pack(
                        place := CASE WHEN is_taken_here THEN p.difference_ns
                            ELSE p.spread_ns END,
                        distance := abs(p.difference_ns - previous_ns),
                        difference_ns := p.difference_ns,
                        vote_count := p.vote_count,
                        spread_ns := p.spread_ns
                    )
                )) AS jump
            FROM (
                SELECT
                    b.clock_id, b.number, b.stretch, b.most, b.patience, b.peaks, b.is_taken_here,
                    f.stretch AS previous_stretch, f.difference_ns AS previous_ns, f.miss_count,
                    list_filter(b.peaks, lambda p: p.vote_count >= 0.8 * b.most) AS high_peaks,
                    list_filter(
                        b.peaks,
                        lambda p: abs(p.difference_ns - f.difference_ns)
                            <= 50000 + (b.stretch + 1 - f.stretch) * b.stretch_ns // 10000
                    ) AS close_peaks,
                    list_max(list_transform(close_peaks, lambda p: p.vote_count)) AS most_close
                FROM followed AS f
                JOIN ballot AS b ON f.clock_id = b.clock_id AND f.number + 1 = b.number
            )
        )
    )
),
-- A jump is noticed late: the stretches before may agree with it already.
agreed AS (
    SELECT b.clock_id, b.stretch, b.stretch_ns, f.vote_count, f.difference_ns
    FROM followed AS f
    JOIN ballot AS b ON f.clock_id = b.clock_id AND f.number = b.number
    WHERE f.vote_count > 0
    UNION ALL
    SELECT
        clock_id, stretch, stretch_ns, near.vote_count::BIGINT, near.difference_ns
    FROM (
        SELECT
            b.clock_id, b.stretch, b.stretch_ns, b.most,
            list_max(list_filter(
                b.peaks,
                lambda p: abs(p.difference_ns - n.difference_ns)
                    <= 50000 + (n.stretch + 1 - b.stretch) * b.stretch_ns // 10000
            )) AS near
        FROM ballot AS b
        JOIN followed AS f
            ON b.clock_id = f.clock_id
            AND b.number = f.number
            AND f.vote_count = 0
            AND NOT f.is_ambiguous
        ASOF JOIN (SELECT * FROM followed WHERE vote_count > 0) AS n
            ON b.clock_id = n.clock_id AND b.stretch < n.stretch
    )
    WHERE near.vote_count >= 0.6 * most
),
steady AS (
    SELECT
        f.clock_id, f.stretch, f.vote_count, f.difference_ns,
        (f.stretch + 0.5) * (f.stretch_ns / 1e9) AS at_s,
        f.stretch_ns,
        sum(CASE WHEN f.is_near THEN 0 ELSE 1 END) OVER (
            PARTITION BY f.clock_id ORDER BY f.stretch ROWS UNBOUNDED PRECEDING
        ) AS segment
    FROM (
        SELECT
            clock_id, stretch, stretch_ns, vote_count, difference_ns,
            abs(difference_ns - lag(difference_ns) OVER on_clock)
                <= 50000 + (stretch - lag(stretch) OVER on_clock + 1) * stretch_ns // 10000
                AS is_near
        FROM agreed
        WINDOW on_clock AS (PARTITION BY clock_id ORDER BY stretch)
    ) AS f
),
-- What is known so far is rough: the slope of it is steadier, and with the slope taken away the
-- same vote is exact. The least difference of a stretch is that at one of its ends.
weighed AS (
    SELECT
        clock_id, stretch, stretch_ns, segment, vote_count, difference_ns, at_s,
        CASE
            WHEN vote_count >= 0.5 * avg(vote_count) OVER (PARTITION BY clock_id)
                AND abs(
                    difference_ns - median(difference_ns) OVER (
                        PARTITION BY clock_id, segment ORDER BY stretch
                        ROWS BETWEEN 2 PRECEDING AND 2 FOLLOWING
                    )
                ) <= 30000 + stretch_ns // 10000
                THEN difference_ns
        END AS heavy_ns
    FROM steady
),
rough AS (
    SELECT
        clock_id, stretch, vote_count,
        heavy_ns IS NOT NULL AS is_heavy,
        count(heavy_ns) OVER around >= 4 AS is_fitted,
        CASE
            WHEN count(heavy_ns) OVER around >= 4 THEN
                (
                    regr_intercept(heavy_ns, at_s) OVER around
                    + at_s * regr_slope(heavy_ns, at_s) OVER around
                    + abs(regr_slope(heavy_ns, at_s) OVER around) * stretch_ns / 2e9
                )::BIGINT
            ELSE difference_ns
        END AS difference_ns,
        CASE WHEN count(heavy_ns) OVER around >= 4 THEN regr_slope(heavy_ns, at_s) OVER around
            ELSE 0 END AS slope
    FROM weighed
    WINDOW around AS (
        PARTITION BY clock_id, segment ORDER BY stretch
        ROWS BETWEEN 10 PRECEDING AND 10 FOLLOWING
    )
),
expected AS (
    SELECT
        r.clock_id, r.stretch, a.greatest_ns, a.least_ns, a.later_ns, a.slack_ns,
        x.fine_slack_ns,
        r.difference_ns + (
            r.slope * (a.written_ns - x.start_ns - (r.stretch + 0.5) * x.stretch_ns) / 1e9
        )::BIGINT AS difference_ns
    FROM paired AS a
    JOIN rough AS r ON a.clock_id = r.clock_id AND a.stretch = r.stretch
    JOIN extent AS x ON a.clock_id = x.clock_id
    WHERE a.later_ns IS NULL OR a.later_ns < a.greatest_ns
),
residue AS (
    SELECT
        clock_id, stretch,
        greatest_ns + fine_slack_ns - difference_ns AS greatest_ns,
        greatest(least_ns - fine_slack_ns, later_ns + fine_slack_ns) - difference_ns AS least_ns
    FROM expected
    WHERE greatest_ns + slack_ns >= difference_ns AND least_ns - slack_ns <= difference_ns
),
fine_edge AS (
    SELECT clock_id, stretch, least_ns AS residue_ns, 1 AS step FROM residue
    UNION ALL
    SELECT clock_id, stretch, greatest(least_ns + 1, greatest_ns), -1 FROM residue
),
fine_vote AS (
    SELECT
        clock_id, stretch, residue_ns, step,
        sum(step) OVER (
            PARTITION BY clock_id, stretch ORDER BY residue_ns, step ROWS UNBOUNDED PRECEDING
        ) + 1 AS vote_count
    FROM fine_edge
),
near_vote AS (
    SELECT
        v.clock_id, v.stretch, v.residue_ns - x.fine_slack_ns AS residue_ns, v.vote_count,
        CASE WHEN r.is_heavy THEN v.vote_count = max(v.vote_count) OVER in_stretch
            ELSE v.vote_count >= 0.85 * max(v.vote_count) OVER in_stretch END AS is_enough
    FROM fine_vote AS v
    JOIN rough AS r ON v.clock_id = r.clock_id AND v.stretch = r.stretch
    JOIN extent AS x ON v.clock_id = x.clock_id
    WHERE v.step = -1
        AND (
            NOT r.is_fitted
            OR abs(v.residue_ns - x.fine_slack_ns) <= 4000 + x.stretch_ns // 125000
                + greatest(abs(r.slope) - 50000, 0) * x.stretch_ns / 2e9
        )
    WINDOW in_stretch AS (PARTITION BY v.clock_id, v.stretch)
),
fine AS (
    SELECT
        clock_id, stretch,
        arg_min(residue_ns, (abs(residue_ns), residue_ns)) AS residue_ns,
        max(vote_count) AS vote_count
    FROM near_vote
    WHERE is_enough
    GROUP BY clock_id, stretch
)
SELECT
    x.run_id,
    r.clock_id,
    x.start_ns + r.stretch * x.stretch_ns + x.stretch_ns // 2 AS at_ns,
    x.start_ns + r.stretch * x.stretch_ns AS start_ns,
    x.start_ns + (r.stretch + 1) * x.stretch_ns AS end_ns,
    r.difference_ns + coalesce(f.residue_ns, 0) AS difference_ns,
    r.slope::BIGINT AS drift_ppb,
    CASE WHEN abs(r.slope) <= 175000 THEN coalesce(f.vote_count, r.vote_count) ELSE 0 END::BIGINT
        AS message_count
FROM rough AS r
JOIN extent AS x ON r.clock_id = x.clock_id
LEFT JOIN fine AS f ON r.clock_id = f.clock_id AND r.stretch = f.stretch
UNION ALL
SELECT
    x.run_id,
    f.clock_id,
    x.start_ns + f.stretch * x.stretch_ns + x.stretch_ns // 2,
    x.start_ns + f.stretch * x.stretch_ns,
    x.start_ns + (f.stretch + 1) * x.stretch_ns,
    f.difference_ns,
    0,
    0
FROM followed AS f
JOIN extent AS x ON f.clock_id = x.clock_id
WHERE f.is_ambiguous
