<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<!-- Light hypsometric tints, made to be seen under a hillshade with blend mode "Multiply".
     The values here are placeholders: the tools stretch the ramp over the layer's own range. -->
<qgis version="3.22.0" styleCategories="Symbology">
  <pipe>
    <provider>
      <resampling enabled="true" zoomedInResamplingMethod="bilinear" zoomedOutResamplingMethod="nearestNeighbour" maxOversampling="2"/>
    </provider>
    <rasterrenderer type="singlebandpseudocolor" band="1" opacity="1" alphaBand="-1" nodataColor="" classificationMin="0" classificationMax="1000">
      <rasterTransparency/>
      <minMaxOrigin>
        <limits>None</limits>
        <extent>WholeRaster</extent>
        <statAccuracy>Estimated</statAccuracy>
      </minMaxOrigin>
      <rastershader>
        <colorrampshader colorRampType="INTERPOLATED" classificationMode="1" clip="0" minimumValue="0" maximumValue="1000" labelPrecision="0">
          <colorramp type="gradient" name="[source]">
            <Option type="Map">
              <Option type="QString" name="color1" value="150,184,142,255"/>
              <Option type="QString" name="color2" value="250,249,247,255"/>
              <Option type="QString" name="discrete" value="0"/>
              <Option type="QString" name="rampType" value="gradient"/>
              <Option type="QString" name="stops" value="0.12;184,204,152,255:0.28;224,218,166,255:0.46;226,196,150,255:0.64;205,170,140,255:0.82;214,200,190,255"/>
            </Option>
          </colorramp>
          <item value="0" label="0" color="#96b88e" alpha="255"/>
          <item value="120" label="120" color="#b8cc98" alpha="255"/>
          <item value="280" label="280" color="#e0daa6" alpha="255"/>
          <item value="460" label="460" color="#e2c496" alpha="255"/>
          <item value="640" label="640" color="#cdaa8c" alpha="255"/>
          <item value="820" label="820" color="#d6c8be" alpha="255"/>
          <item value="1000" label="1000" color="#faf9f7" alpha="255"/>
        </colorrampshader>
      </rastershader>
    </rasterrenderer>
    <brightnesscontrast brightness="0" contrast="0" gamma="1"/>
    <huesaturation saturation="0" grayscaleMode="0" colorizeOn="0"/>
    <rasterresampler maxOversampling="2"/>
    <resamplingStage>provider</resamplingStage>
  </pipe>
  <blendMode>0</blendMode>
</qgis>
