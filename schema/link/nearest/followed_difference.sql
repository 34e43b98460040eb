-- description: Which of the differences that messages agree with is the right one, from stretch
--     to stretch. The clocks of one machine begin together (a few messages are enough to say so),
--     and then drift: of the differences that a drift can lead to, the one that most messages
--     agree with is taken. If there is none, the clock has jumped, provided that the next two
--     stretches agree (in the last two stretches, nothing is known then). It jumped to the least
--     difference that many messages agree with, since a message is taken, and stamped, soon after
--     it was published; of those within a burst, to the one with most messages, of equal ones to
--     the greatest. If messages were taken on other clocks, nothing says which of several
--     differences is right. If messages taken on this clock could as well be those of later
--     publications, the clock may have jumped by a period, and nothing is known.
-- grain: one row per clock and stretch of time; message_count is 0 where nothing is known
-- param: regions VARCHAR  Rows as of derive.agreed_difference, is_taken_here, stretch_ns
CREATE OR REPLACE MACRO derive.followed_difference(regions) AS TABLE
WITH RECURSIVE preferred AS (
    SELECT
        clock_id, stretch, difference_ns, wander_ns,
        lead(difference_ns, 1) OVER on_clock AS next_ns,
        lead(stretch, 1) OVER on_clock - stretch + 1 AS until_next,
        lead(difference_ns, 2) OVER on_clock AS later_ns,
        lead(stretch, 2) OVER on_clock - stretch + 1 AS until_later
    FROM (
        SELECT
            clock_id, stretch,
            any_value(wander_ns) AS wander_ns,
            max({'votes': vote_count, 'difference_ns': difference_ns}).difference_ns
                AS difference_ns
        FROM (
            SELECT
                clock_id, stretch, difference_ns, vote_count, most_count, is_taken_here,
                stretch_ns::DOUBLE * derive.clock_limit().drift_ppb / 1e9 AS wander_ns,
                min(difference_ns) OVER in_stretch + derive.clock_limit().burst_ns AS first_ns,
                max(difference_ns) OVER in_stretch AS last_ns
            FROM query_table(regions)
            WINDOW in_stretch AS (PARTITION BY clock_id, stretch)
        )
        WHERE most_count >= derive.clock_limit().quorum
            AND difference_ns <= first_ns
            AND (is_taken_here OR last_ns <= first_ns)
        GROUP BY clock_id, stretch
    )
    WINDOW on_clock AS (PARTITION BY clock_id ORDER BY stretch)
),
ballot AS MATERIALIZED (
    SELECT
        r.clock_id, r.stretch,
        row_number() OVER (PARTITION BY r.clock_id ORDER BY r.stretch) AS number,
        any_value(r.stretch_ns)::DOUBLE * derive.clock_limit().drift_ppb / 1e9 AS wander_ns,
        CASE WHEN any_value(r.is_taken_here)
            THEN min(r.difference_ns) + derive.clock_limit().burst_ns END AS latest_ns,
        any_value(r.most_count) AS most_count,
        list(
            struct_pack(
                vote_count := r.vote_count,
                difference_ns := r.difference_ns,
                least_ns := r.least_ns,
                greatest_ns := r.greatest_ns
            )
        ) AS regions,
        any_value(
            CASE
                WHEN coalesce(abs(t.next_ns - t.difference_ns) <= t.until_next * t.wander_ns, true)
                    AND coalesce(
                        abs(t.later_ns - t.difference_ns) <= t.until_later * t.wander_ns, true
                    )
                    THEN t.difference_ns
            END
        ) AS jump_ns,
        -- Behind the last two stretches there are no two that could agree. In a recording of only
        -- two stretches a clock may begin there all the same.
        any_value(t.later_ns) IS NOT NULL AS has_later,
        count(*) OVER (PARTITION BY r.clock_id) <= 2 AS is_short
    FROM query_table(regions) AS r
    LEFT JOIN preferred AS t ON r.clock_id = t.clock_id AND r.stretch = t.stretch
    GROUP BY r.clock_id, r.stretch
),
followed (
    clock_id, number, stretch, difference_ns, message_count, segment, since_stretch, is_begun
) AS (
    SELECT
        clock_id,
        0::BIGINT,
        stretch,
        0::BIGINT,
        0::BIGINT,
        0::BIGINT,
        stretch, false
    FROM ballot
    WHERE number = 1
    UNION ALL
    SELECT
        clock_id, number, stretch,
        coalesce(near.difference_ns, jump_ns, previous_ns),
        CASE
            WHEN near.difference_ns > latest_ns THEN 0
            WHEN near IS NOT NULL THEN near.vote_count
            WHEN jump_ns IS NOT NULL THEN most_count
            ELSE 0
        END,
        CASE WHEN near IS NULL AND jump_ns IS NOT NULL THEN segment + 1 ELSE segment END,
        CASE WHEN near IS NULL AND jump_ns IS NULL THEN since_stretch ELSE stretch END,
        is_begun OR near IS NOT NULL OR jump_ns IS NOT NULL
    FROM (
        SELECT
            b.clock_id, b.number, b.stretch, b.latest_ns, b.most_count,
            CASE WHEN b.has_later OR b.is_short AND NOT f.is_begun THEN b.jump_ns END
                AS jump_ns,
            f.difference_ns AS previous_ns,
            f.segment, f.since_stretch, f.is_begun,
            list_max(
                list_transform(
                    list_filter(
                        b.regions,
                        lambda r: greatest(
                            r.least_ns - f.difference_ns, f.difference_ns - r.greatest_ns
                        ) <= (b.stretch - f.since_stretch + 1) * b.wander_ns
                            AND (
                                r.vote_count >= derive.clock_limit().quorum
                                OR NOT f.is_begun
                                AND f.difference_ns BETWEEN r.least_ns AND r.greatest_ns
                            )
                    ),
                    lambda r: struct_pack(
                        vote_count := r.vote_count,
                        closeness := -abs(r.difference_ns - f.difference_ns),
                        difference_ns := r.difference_ns
                    )
                )
            ) AS near
        FROM followed AS f
        JOIN ballot AS b ON f.clock_id = b.clock_id AND f.number + 1 = b.number
    )
)
SELECT f.clock_id, f.stretch, f.difference_ns, f.message_count, f.segment
FROM followed AS f
JOIN ballot AS b ON f.clock_id = b.clock_id AND f.number = b.number
WHERE f.message_count > 0 OR b.most_count >= derive.clock_limit().quorum
