"""Where robots may be and what driving there costs."""
